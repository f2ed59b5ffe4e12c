"""The decision page: a ranked Pareto set to look at, limit and choose from, in one HTML file.

:func:`decision_page` makes a :class:`DecisionPage` of any source of designs; ``save`` writes it as
the file, and a notebook shows it at once. A decision that the page saves is a
:class:`~pymoo_psi.table.Formulation` in JSON with a chosen design and a reason;
:func:`kept_designs` tells which designs its reader kept by texts.

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

from pymoo_psi.page._page import DecisionPage, decision_page, kept_designs

__all__ = ["DecisionPage", "decision_page", "kept_designs"]
