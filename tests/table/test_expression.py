"""Expressions of columns: what they compute, and what a text of anybody's hand can do."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pymoo_psi import PsiError
from pymoo_psi.table._expression import Expression

COLUMNS = {
    "a": np.array([1.5, -2.0, 0.0, 1e300]),
    "b": np.array([0.25, 3.0, -1.0, np.nan]),
    "two": np.full(4, 2.0),
    "mass, `kg`": np.array([1, 2, 3, 4]),
    "σ_max": np.array([True, False, True, True]),
    "metal": np.array(["iron", "steel", "iron", "iron"], dtype=object),
    "mixed": np.array([1, 2.5, 3, True], dtype=object),
}
NUMPY = {
    "sqrt": np.sqrt, "abs": np.abs, "exp": np.exp, "sin": np.sin, "log": np.log, "atan": np.arctan,
    "min": np.minimum, "max": np.maximum,
}  # fmt: skip


def values(text):
    return Expression.of(text).values(COLUMNS)


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


@settings(max_examples=100)
@given(text=st.recursive(st.sampled_from(["a", "b", "two"]), longer, max_leaves=10))
def test_precedence_and_values_are_those_of_python_on_arrays(text):
    with np.errstate(all="ignore"):
        expected = eval(text, {"__builtins__": {}}, NUMPY | COLUMNS)
    np.testing.assert_array_equal(values(text), expected)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a*0 + 2**3**2", [512.0] * 4),
        ("-two**2 + 1e1 - .5 + 3.", [8.5] * 4),
        ("two * pi", [2 * np.pi] * 4),
        ("`mass, ``kg``` / two", [0.5, 1, 1.5, 2]),
        ("σ_max + 1", [2.0, 1, 2, 2]),
        ("mixed*2", [2.0, 5, 6, 2]),
        ("min(two, 3, 1.5)", [1.5] * 4),
        ("two / (two - 2)", [np.inf] * 4),
        ("log(0 - two)", [np.nan] * 4),
        ("two**9**9**9", [np.inf] * 4),  # in Python a number of millions of digits
    ],
)
def test_values(text, expected):
    np.testing.assert_allclose(values(text), expected, rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "continued by a number, a column or a parenthesis, got its end"),
        ("a +", "got its end"),
        ("(a", r"continued by '\)' or an operation, got its end"),
        ("a b", "continued by an operation, got 'b' at character 3"),
        ("a^2", r"got '\^2' at character 2; powers are written width\*\*2"),
        ("mass kg", "got 'kg' at character 6; names of other than letters.* in backquotes"),
        ("`mass", "got '`mass' at character 1"),
        ("a; b", "got '; b'"),
        ("1,5*a", "got ',5"),
        ("a == b", "got '== b'"),
        ("a // b", "got '/ b'"),
        ("a if b else a", "got 'if b"),
        ("[a]", r"got '\[a\]'"),
        ("'a'", "got \"'a'\""),
        ("a.real", r"got '.real'"),
        ("lambda: a", "got ': a'"),
        ("a := b", "got ':= b'"),
        ("__import__('os').system('x')", "a function of .* must be one of 'abs'"),
        ("open(a)", "a function of 'open.a.' must be one of"),
        ("a(b)", "a function of"),
        ("sqrt(a, b)", r"sqrt\(\) of .* must be of one value, got 2"),
        ("min(a)", r"min\(\) of .* must be of two values or more, got 1"),
        ("__class__", "a column of '__class__' must be one of 'a'"),
        ("σ_mac", "did you mean 'σ_max'"),
        ("2.5", "an expression must be one of a column or more"),
        ("metal * 2", "only columns of numbers can be limited and computed with, .* holds 'iron'"),
        ("(" * 300 + "a" + ")" * 300, "nested at most 50 levels deep"),
        ("-" * 300 + "a", "nested at most 50 levels deep"),
        ("two**" * 300 + "a", "nested at most 50 levels deep"),
        ("abs(" * 300, "nested at most 50 levels deep"),
        ("a" * 3000, "of at most 2000 characters, got 3000"),
    ],
)  # fmt: skip
def test_any_other_text_is_refused_with_a_reason(text, message):
    with pytest.raises(PsiError, match=message):
        values(text)


@settings(max_examples=150)
@given(text=st.one_of(st.text(), st.text(alphabet="ab12.e*/+-(),` \n\t^_\0")))
def test_whatever_the_text_the_answer_is_a_column_or_a_message(text):
    try:
        column = values(text)
    except PsiError:
        return
    assert column.dtype == np.float64
    assert column.shape == (4,)


def test_the_longest_texts_are_read_and_computed():
    """Each in a stack of values no deeper than its parentheses, and within Python's own stack."""
    assert values("+".join(["two"] * 500)).tolist() == [1000.0] * 4
    assert values("(" * 49 + "two" + ")" * 49).tolist() == [2.0] * 4


def test_columns_are_not_changed():
    column = np.array([1.0, 2.0])
    result = Expression.of("x").values({"x": column})
    result[0] = 5
    assert column.tolist() == [1.0, 2.0]


def test_only_text_is_an_expression():
    with pytest.raises(TypeError, match="an expression must be text, got 3"):
        Expression.of(3)
