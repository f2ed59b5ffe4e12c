"""The decision page: a ranked Pareto set to look at, limit and choose from, in one HTML file.

:func:`decision_page` makes a :class:`DecisionPage`: the data that the page shows, which ``save``
writes as the file and a notebook shows at once. Of a test table it takes the feasible designs, with
their names, senses and units. ``pymoo-psi page`` makes one of a file.

Example:
    >>> from pymoo.problems import get_problem
    >>> from pymoo_psi import investigate
    >>> from pymoo_psi.page import decision_page
    >>> table = investigate(get_problem("bnh"), 64)
    >>> page = decision_page(table, title="BNH")
    >>> page
    DecisionPage('BNH': 61 designs)

The file needs no network and no library: ``logic.js`` ranks and explains what is left,
``charts.js`` draws on canvas, ``page.js`` has the controls, texts and the table.
"""

from pymoo_psi.page._data import DecisionPage
from pymoo_psi.page._page import decision_page

__all__ = ["DecisionPage", "decision_page"]
