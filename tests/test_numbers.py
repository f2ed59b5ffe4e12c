"""The numbers of a column: one format, told apart, in order, never off by more than half a digit."""

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pymoo_psi._numbers import NumberFormat, decimals_as_given, percents

USUAL = (
    st.floats(-1e8, 1e8)
    | st.integers(-(10**7), 10**7).map(float)
    | st.floats(allow_nan=False, allow_infinity=False, width=64)
)
COLUMNS = st.lists(USUAL, min_size=1, max_size=9)


def read(text):
    """The number that a reader takes from a text."""
    return Fraction(Decimal(text.replace("\N{NO-BREAK SPACE}", "")))


def last_place(text):
    """The unit of the last digit of a text."""
    exponent = Decimal(text.replace("\N{NO-BREAK SPACE}", "")).as_tuple().exponent
    return Fraction(10) ** exponent


def texts_of(values):
    column = NumberFormat.of(values)
    return [column.text(value) for value in values]


@given(COLUMNS)
def test_a_text_is_off_by_half_its_last_digit(values):
    for value, text in zip(values, texts_of(values), strict=True):
        assert abs(read(text) - Fraction(value)) <= last_place(text) / 2


@given(COLUMNS)
def test_texts_keep_the_order_of_numbers(values):
    numbers = [*map(read, texts_of(sorted(values)))]
    assert numbers == sorted(numbers)


@given(COLUMNS)
def test_ends_of_a_column_differ_unless_nearly_equal(values):
    low, high = min(values), max(values)
    column = NumberFormat.of(values)
    size = max(abs(low), abs(high))
    if high / 2 - low / 2 > 1e-9 * size and size < 1e300:
        assert read(column.text(low)) < read(column.text(high))


@given(COLUMNS)
def test_a_column_has_one_style(values):
    texts = texts_of(values)
    decimals = {len(text.partition("e")[0].partition(".")[2]) for text in texts if text != "0"}
    assert len(decimals) <= 1
    assert len({"e" in text for text in texts if text != "0"}) <= 1
    assert max(len(text) for text in texts) <= 24


@given(st.lists(st.integers(-(10**6), 10**6), min_size=1))
def test_integers_stay_integers(values):
    assert "|".join(texts_of(values)).replace("\N{NO-BREAK SPACE}", "") == "|".join(
        map(str, values)
    )


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        ([849, 1299], ["849", "1299"]),
        ([0.99, 1.3, 1.24], ["0.99", "1.30", "1.24"]),
        ([38.41234, 395.5678], ["38.4", "395.6"]),
        ([0.312345, 5.561234], ["0.31", "5.56"]),
        ([725.123, 1.67e9, 4.98e8], ["7.25e2", "1.67e9", "4.98e8"]),
        ([2.5e-6, 1.25e-5, 0.0], ["2.50e-6", "1.25e-5", "0"]),
        ([12345.6789, 90000.1], ["12\N{NO-BREAK SPACE}346", "90\N{NO-BREAK SPACE}000"]),
        ([0.1 + 0.2, 0.7], ["0.3", "0.7"]),
        ([100000.25, 100000.75], ["100\N{NO-BREAK SPACE}000.250", "100\N{NO-BREAK SPACE}000.750"]),
        ([-0.0, 1.0], ["0", "1"]),
        ([1.5, math.inf, -math.inf, math.nan], ["1.5", "∞", "-∞", "—"]),
    ],
)
def test_numbers_as_a_reader_expects_them(values, texts):
    assert texts_of(values) == texts


def test_an_outlier_changes_no_format_of_the_others():
    column = NumberFormat.of([0.123456, 0.7654321, 1e30], near=[0.123456, 0.7654321])
    assert [column.text(value) for value in (0.123456, 1e30)] == ["0.123", "1.000e30"]
    assert decimals_as_given([0.5, 1e308]) == 0  # without a warning


def test_mark_and_minus_are_those_of_the_output():
    column = NumberFormat(2, minus="−", mark=",")
    assert [column.text(value) for value in (-1.5, 2.25)] == ["−1,50", "2,25"]


@given(st.lists(st.floats(0.011, 1), min_size=1, max_size=9))
def test_per_cents_of_one_whole_add_up(sizes):
    shares = np.array(sizes) / sum(sizes)
    texts = percents(shares)
    whole = [int(text.removesuffix(" %")) for text in texts if "less" not in text]
    small = sum(share for share, text in zip(shares, texts, strict=True) if "less" in text)
    assert abs(sum(whole) - 100 * (1 - small)) <= 0.5 + 1e-9
    for text, share in zip(texts, shares, strict=True):
        assert text == "less than 1 %" or abs(int(text[:-2]) - 100 * share) < 1
