"""The paper's results, computed again and compared with its printed values.

``pymoo-psi reproduce``, or :func:`reproduce`, computes Tables 6.1 and 6.2 under both models of
:mod:`pymoo_psi.chute`, compares them with the printed ones, and draws Figures 2 to 8. Under
``rolling`` it finds the same seven designs. f2, f3 and f4 agree to all four printed decimals; f1 is
4e-4 to 6e-4 above the printed values, because of an error of the paper's solver. For μ = 0.6
no design has the rank of efficiency 5. The test point that Table 6.2 prints as 1356 is number 2571,
as its f3 and f4 show.

The Salukvadze optima of 4096 test points by plain distances, with their numbers:

=== ========================= ==== ==============================
μ   optimum                   test f1, f2, f3, f4
=== ========================= ==== ==============================
0.2 printed                   –    1.9829, 0.0532, 0.3074, 0.1130
0.2 under ``rolling``         3599 1.9834, 0.0532, 0.3074, 0.1130
0.2 that one under ``full``   3599 2.1918, 0.0244, 0.3074, 0.1130
0.2 under ``full``            4006 1.9684, 0.0407, 0.4537, 0.1706
0.4 printed                   –    2.0454, 0.0476, 0.2635, 0.1072
0.4 under ``rolling``         3085 2.0458, 0.0476, 0.2635, 0.1072
0.4 that one under ``full``   3085 2.3214, 0.0159, 0.2635, 0.1072
0.4 under ``full``            2571 2.0541, 0.0195, 0.4392, 0.1043
0.6 printed                   –    2.0454, 0.0476, 0.2635, 0.1144
0.6 under ``rolling``         1029 2.0458, 0.0476, 0.2635, 0.1144
0.6 that one under ``full``   1029 2.3296, 0.0142, 0.2635, 0.1144
0.6 under ``full``            1709 2.0630, 0.0129, 0.4378, 0.1778
=== ========================= ==== ==============================

Example:
    The paper's optimum for μ = 0.4, by its own procedure: 4096 test points, plain distances.

    >>> from pymoo.optimize import minimize
    >>> from pymoo_psi import PSI, VectorizedSphereChute, rank_of_efficiency
    >>> res = minimize(VectorizedSphereChute(mu=0.4, model="rolling"), PSI(4096))
    >>> best = rank_of_efficiency(res.F, normalize=False).salukvadze
    >>> print(res.opt.get("test_point")[best], res.F[best].round(4))
    [3085] [[2.0458 0.0476 0.2635 0.1072]]

Public names: :func:`reproduce` and its :class:`Reproduction`; :func:`solve_case` and its
:class:`Case`; :func:`published_table`.
"""

from pymoo_psi.paper._reproduction import Case, Reproduction, published_table, reproduce, solve_case

# Names that other subpackages share; they are no promise to users.
# isort: split
from pymoo_psi.paper._reproduction import PAPER_MU as PAPER_MU
from pymoo_psi.paper._reproduction import PAPER_POINTS as PAPER_POINTS
from pymoo_psi.paper._reproduction import criterion_surfaces as criterion_surfaces
from pymoo_psi.paper._reproduction import salukvadze_functions as salukvadze_functions

__all__ = [
    "Case",
    "Reproduction",
    "published_table",
    "reproduce",
    "solve_case",
]
