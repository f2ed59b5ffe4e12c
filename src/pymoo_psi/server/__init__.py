"""The page of a study that grows, to watch and steer a run in a browser.

:func:`live` shows a study in a notebook and returns the address of its page; the command
``pymoo-psi live`` does the same in a terminal. Both need the extra ``live``.

It is the decision page. A server in a separate process reads the study when it has changed and
sends new designs as server-sent events; the page ranks them. Requests to the run are stored in the
study, and the run reads them between two proposals. The run does not depend on page or server: it
may be on another machine, and continues when they end.

The server listens on 127.0.0.1 by default. Its address contains a token. Requests from other pages
or for other host names are refused, and the size of requests is bounded. The server accesses only
the study and the file with the address beside it.
"""

from pymoo_psi.server._server import live

# Names that other subpackages share; they are no promise to users.
# isort: split
from pymoo_psi.server._server import GrowingStudy as GrowingStudy
from pymoo_psi.server._server import LiveView as LiveView
from pymoo_psi.server._server import serve as serve

__all__ = [
    "live",
]
