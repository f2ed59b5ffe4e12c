"""``solve --box``: what is typed, and what is told to be typed next."""

import numpy as np
import pandas as pd
import pytest
from pymoo.core.problem import ElementwiseProblem
from pymoo.core.variable import Binary, Choice, Integer, Real

from pymoo_psi import PsiError, Restricted, VectorizedSphereChute, investigate
from pymoo_psi.cli import main
from pymoo_psi.cli._options import box_in, box_text
from tests.table.exact_csv import EXACT


class Beam(ElementwiseProblem):
    def __init__(self):
        variables = {
            "width, mm": Real(bounds=(100, 2000)),
            "a=b": Real(bounds=(-1e-3, 3e-3)),
            "ribs": Integer(bounds=(1, 9)),
            "metal": Choice(options=["iron", "steel, cast", 3]),
            "hollow": Binary(),
        }
        super().__init__(vars=variables, n_obj=2)

    def _evaluate(self, x, out, *args, **kwargs):
        width = x["width, mm"] * (0.5 if x["hollow"] else 1) + 1e5 * x["a=b"]
        out["F"] = [width * x["ribs"], abs(500 - width) + len(str(x["metal"]))]


BEAM = Beam()


@pytest.mark.parametrize(
    ("entries", "box"),
    [
        (["ribs=2:5"], {"ribs": (2, 5)}),
        (["ribs = 3"], {"ribs": 3}),
        (["width, mm=:500", "ribs=2:"], {"width, mm": (None, 500), "ribs": (2, None)}),
        (['"width, mm=1e2:5e2",hollow=True'], {"width, mm": (100, 500), "hollow": True}),
        (["a=b=-.001:0.002"], {"a=b": (-0.001, 0.002)}),
        (["metal=3"], {"metal": 3}),
        (['"metal=iron|steel, cast"', "a=b=0"], {"metal": ["iron", "steel, cast"], "a=b": 0}),
    ],
)
def test_what_is_typed(entries, box):
    assert box_in(entries, BEAM) == box


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("ribs", "of the form variable=lower:upper or variable=value"),
        ("", "of the form variable=lower:upper or variable=value"),
        ("ribs=", "of the form variable=lower:upper"),
        ("rib=2", "did you mean 'ribs'"),
        ("ribs=1:2:3", "ribs=lower:upper or ribs=value, in numbers"),
        ("ribs=1_0", "ribs=lower:upper or ribs=value, in numbers"),
        ("ribs=1,ribs=2", "given once for each variable"),
        ("metal=gold", "one of '3', 'iron', 'steel, cast'"),
        ("hollow=yes", "one of 'False', 'True', got 'yes'"),
    ],
)
def test_what_is_mistyped(text, message):
    with pytest.raises(PsiError, match=message):
        box_in([text], BEAM)


@pytest.mark.parametrize("box", [{}, {"metal": ["iron", 3], "ribs": (2, 7)}, {"hollow": True}])
@pytest.mark.parametrize("limit", [500.0, 1000.0, 1e9])
def test_the_box_that_is_told_holds_what_is_feasible(box, limit):
    part = Restricted(Beam(), box)
    table, limits = investigate(part, 64), {"f1": limit}
    text = box_text(table, limits, part)
    told = Restricted(Beam(), box_in([text], BEAM) if text else {})
    shown = told.space.variables
    for name, column, variable in zip(
        list(BEAM.vars), table.X[table.feasible(limits)].T, shown, strict=True
    ):
        kept = box.get(name)
        if isinstance(kept, list):
            assert list(variable.options) == kept
        elif name == "hollow":
            assert variable.fixed == (kept is not None)
        elif name != "metal":
            low, high = min(column), max(column)
            room = 2e-3 * (high - low)  # a thousandth on each side, rounded outwards
            assert low - room <= variable.lower <= low
            assert high <= variable.upper <= high + room


@pytest.mark.parametrize("algorithm", ["psi", "nsga3"])
def test_solve_in_a_part(tmp_path, capsys, algorithm):
    out = tmp_path / "front.csv"
    words = ["solve", "chute", "--mu", "0.4", "--points", "64", "--box", "x1=0.5,x2=1:3"]
    assert main([*words, "--algorithm", algorithm, "--out", str(out)]) == 0
    front = pd.read_csv(out, **EXACT)
    assert (front["x1"] == 0.5).all()
    assert front["x2"].between(1, 3).all()
    F, _ = VectorizedSphereChute(0.4).evaluate(front[["x1", "x2"]].to_numpy())
    np.testing.assert_array_equal(front[["f1", "f2", "f3", "f4"]], F)
    capsys.readouterr()
    assert main([*words[:-1], "x1=9"]) == 2
    assert "x1 of box must be within the problem's box, 0.0 to 1.4" in capsys.readouterr().err


def test_more_variables_than_lp_tau_has_are_told(capsys):
    assert main(["solve", "pymoo.problems.multi:ZDT5", "--points", "16"]) == 0
    assert (
        "More variables than LPτ has, 80: the test points are Sobol' points"
        in capsys.readouterr().out
    )
