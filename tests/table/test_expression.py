"""Expressions of columns: what they compute, and what an untrusted text can do."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from pymoo_psi import Formulation, PsiError, TestTable
from pymoo_psi._names import operand
from pymoo_psi.table import Expression
from tests.helpers.draws import examples
from tests.helpers.refusals import refused

COLUMNS = {
    "a": np.array([1.5, -2.0, 0.0, 1e300]),
    "b": np.array([0.25, 3.0, -1.0, np.nan]),
    "two": np.full(4, 2.0),
    "mass, `kg`": np.array([1.0, 2, 3, 4]),
    "σ_max": np.array([1.0, 0, 1, 1]),
}
TABLE = TestTable.of(
    range(1, 5), [{"metal": "iron", "steps": k} for k in range(4)], np.ones((4, 1)), outputs=COLUMNS
)
NUMPY = {
    "sqrt": np.sqrt, "abs": np.abs, "exp": np.exp, "sin": np.sin, "log": np.log, "atan": np.arctan,
    "min": np.minimum, "max": np.maximum,
}  # fmt: skip


def values(text):
    return TABLE.under(Formulation(computed={"result": text})).column("result")


def longer(parts):
    signs = st.sampled_from(["+", "-", "*", "/", "**", " - ", " ** "])
    return st.one_of(
        st.tuples(parts, signs, parts).map("".join),
        parts.map("({})".format),
        parts.map("-{}".format),
        parts.map("+ {}".format),
        st.builds("{}({})".format, st.sampled_from(["sqrt", "abs", "exp", "sin", "log", "atan"]), parts),
        st.builds("{}({}, {})".format, st.sampled_from(["min", "max"]), parts, parts),
    )  # fmt: skip


@examples(4)
@given(text=st.recursive(st.sampled_from(["a", "b", "two"]), longer, max_leaves=10))
def test_precedence_and_values_are_those_of_python_on_arrays(text):
    with np.errstate(all="ignore"):
        expected = eval(text, {"__builtins__": {}}, NUMPY | COLUMNS)
    np.testing.assert_allclose(values(text), expected, rtol=1e-14)  # 15 digits


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a*0 + 2**3**2", [512.0] * 4),
        ("-two**2 + 1e1 - .5 + 3.", [8.5] * 4),
        ("two * pi", [2 * np.pi] * 4),
        ("`mass, ``kg``` / two", [0.5, 1, 1.5, 2]),
        ("min(two, 3, 1.5)", [1.5] * 4),
        ("two / (two - 2)", [np.inf] * 4),
        ("log(0 - two)", [np.nan] * 4),
        ("two**9**9**9", [np.inf] * 4),  # in Python a number of millions of digits
        ("+".join(["two"] * 500), [1000.0] * 4),
    ],
)
def test_values(text, expected):
    np.testing.assert_allclose(values(text), expected, rtol=1e-15)


@given(name=st.text(min_size=1).filter(lambda name: name != "pi"))
@example("N·m")  # an identifier of Python
def test_any_name_is_written_as_it_is_read(name):
    assert Expression.of(operand(name)).columns == [name]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a +",
        "a^2",
        "`mass",
        "a == b",
        "a if b else a",
        "a.real",
        "min(**a)",
        "__import__('os').system('x')",
        "(" * 300 + "a" + ")" * 300,
    ],
)  # fmt: skip
def test_what_is_no_arithmetic_of_columns_is_refused(text):
    refused("an expression must be arithmetic of columns, such as", values, text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("open(a)", "a function of an expression must be one of 'abs'"),
        ("sqrt(a, b)", r"sqrt\(\) of an expression must be of one value, min .* more, got 2"),
        ("sqrt()", r"sqrt\(\) of an expression must be of one value, min .* more, got 0"),
        ("min(a)", r"min\(\) of an expression must be .* of two values or more, got 1"),
        ("σ_mac", "did you mean 'σ_max'"),
        ("metal * 2", "only columns of numbers can be limited and computed with, .* holds 'iron'"),
    ],
)
def test_unknown_names_and_wrong_values_are_named(text, message):
    refused(message, values, text)


@examples(4)
@given(text=st.one_of(st.text(), st.text(alphabet="ab12.e*/+-(),` \n\t^_\0")))
def test_any_text_gives_a_column_or_a_message(text):
    with suppress(PsiError):
        column = values(text)
        assert (column.dtype, column.shape) == (np.float64, (4,))
