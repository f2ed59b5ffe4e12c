"""The decision page: one HTML file for exploring, limiting and choosing from a Pareto set.

:func:`decision_page` makes a :class:`DecisionPage` from any source of designs. ``save`` writes the
file; a notebook shows the page. A decision that is saved on the page is a
:class:`~pymoo_psi.Decision` in JSON: a formulation with a chosen design and a reason.

Example:
    >>> from pymoo.problems import get_problem
    >>> from pymoo_psi import investigate
    >>> from pymoo_psi.page import decision_page
    >>> table = investigate(get_problem("bnh"), 64)
    >>> page = decision_page(table, title="BNH")
    >>> page
    DecisionPage('BNH': 61 designs)

The file needs no network and no library. Its scripts are files of one subject each, joined by
Python: first those that rank and explain the designs within the limits and need no document
(``data.js`` … ``exports.js``), then those that draw and listen (``state.js``, ``rows.js``,
``scatter.js``, …). ``live.js`` connects the page of a growing study, see :mod:`pymoo_psi.server`.
"""

from pymoo_psi.page._page import DecisionPage, decision_page

# Names that other subpackages share; they are no promise to users.
# isort: split
from pymoo_psi.page._page import designs_of_page as designs_of_page
from pymoo_psi.page._page import existing_designs as existing_designs
from pymoo_psi.page._page import fonts as fonts
from pymoo_psi.page._page import page_of_tests as page_of_tests
from pymoo_psi.page._payload import number_formats as number_formats
from pymoo_psi.page._payload import rows_of as rows_of
from pymoo_psi.page._payload import without_outliers as without_outliers

__all__ = [
    "DecisionPage",
    "decision_page",
]
