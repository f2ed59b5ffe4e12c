"""A study that grows, watched in a browser, and the run that is steered there.

:func:`live` shows a study in a notebook, or gives the address of its page; the command
``pymoo-psi live`` does the same. This needs the extra ``live``.

The page is the decision page. A server of its own process reads the study again when it has changed
and sends new designs as server-sent events; the page ranks them. What people ask of the run is
written into the study, and the run reads it there between two proposals. So the run needs neither
page nor server, may be at work on another machine, and goes on when they end.

The server listens on 127.0.0.1 unless it is asked otherwise. Its address has a token; requests of
other pages and names of hosts are refused, whatever comes is bounded, and nothing is read or
written but the study and the file with the address beside it.
"""

from pymoo_psi.server._server import live

# Names that other subpackages share; they are no promise to users.
# isort: split
from pymoo_psi.server._server import GrowingStudy as GrowingStudy
from pymoo_psi.server._server import serve as serve

__all__ = [
    "live",
]
