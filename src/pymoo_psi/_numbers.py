"""Numbers as people read them: one format a column, single numbers, shares, the decimal mark.

:class:`NumberFormat` is made once from the values of a column. The terminal, reports and figures
write the numbers of the column by its ``text``, the page by its ``pattern``. :func:`number` and
:func:`percent` write the numbers of sentences. The decimal mark is that of the table from which the
numbers are.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from math import ceil, floor, isinf, isnan, log10
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pymoo_psi._validation import Array

_APART = "\N{NO-BREAK SPACE}"
_STEPS = 500  # a written number tells so many values within the range of its column apart
_AS_GIVEN = 3  # decimals up to which values are written as they are
_SAME = 1e-12  # values closer than this, relatively, differ by rounding only
_MOST = 12  # decimals, and digits of a number that somebody has given
_SAFE_DIGITS = 15  # without the rounding of a calculation
_ALL_DIGITS = 17  # of a float64
_LONG = 1e6  # from this size on numbers with decimals are written with a power of ten
_LONGEST = 1e7  # and from this size on all numbers
_DIGITS_OF_LONG = 4  # of numbers beyond it
_SHORT = 1e-4
_DIGITS = 6  # and with more digits, if a column spans decades
_ALL = 100 - 1e-7  # per cent, up to rounding
LOG_RANGE = 100.0  # the least ratio between the ends of a logarithmic axis


@dataclass(frozen=True)
class NumberFormat:
    """How the numbers of a column are written.

    All have the same number of decimals, or are all written with a power of ten, as 1.67e9.

    Attributes:
        decimals: Digits behind the decimal mark; with a power of ten, those of the factor.
        has_powers: Whether numbers are written with a power of ten.
        minus: The minus sign; "−" where the output is typographic.
        mark: The decimal mark.

    Example:
        >>> costs = NumberFormat.of([12.3456, 99.8765, 140.0])
        >>> costs.text(12.3456), costs.text(140.0)
        ('12.3', '140.0')
        >>> NumberFormat.of([725.0, 1.67e9]).text(725.0)
        '7.25e2'
    """

    decimals: int
    has_powers: bool = False
    minus: str = "-"
    mark: str = "."

    @classmethod
    def of(cls, values: ArrayLike, near: ArrayLike | None = None, mark: str = ".") -> NumberFormat:
        """Return the format that tells the values of a column apart.

        Values of up to three decimals and seven digits are written as they are. Otherwise the
        decimals follow the range: 500 values within it are told apart, and of more than three
        decades the least value has two digits, unless the greatest would have six or more. Then
        values for a logarithmic axis have a power of ten, as numbers of 1e6 and more or below 1e-4.

        Args:
            values: All values of the column; those that are not finite are ignored.
            near: Those that readers compare, by default all.
            mark: The decimal mark.
        """
        finite = _finite(values)
        compared = finite
        if near is not None:
            compared = _finite(near)
        if not compared.any():  # all are 0, or there are none
            compared = finite
        if not compared.any():
            return cls(0, mark=mark)
        size = float(np.abs(compared).max())
        decimals = _decimals(finite[np.abs(finite) < _LONGEST])  # others are written otherwise
        if decimals is not None and size < _LONGEST / 10**decimals:
            return cls(decimals, mark=mark)
        decimals, has_powers = _rounded_format(compared, size)
        return cls(min(decimals, _MOST), has_powers, mark=mark)

    def text(self, value: float) -> str:
        r"""Return a number of the column; "—" for NaN.

        Example:
            >>> NumberFormat(1).text(12345.67), NumberFormat(2, has_powers=True).text(12345.67)
            ('12\xa0345.7', '1.23e4')
        """
        if isnan(value):
            return "—"
        if isinf(value):
            text = "∞"
            if value < 0:
                text = "-∞"
        elif self.has_powers:
            text = _with_power(value, self.decimals)
        elif abs(value) >= _LONGEST:  # it is beyond the range of the column, a penalty perhaps
            text = _with_power(value, _DIGITS_OF_LONG - 1)
        else:
            text = _grouped(f"{round(value, self.decimals) + 0.0:.{self.decimals}f}")  # no -0
        return text.replace(".", self.mark).replace("-", self.minus)

    def digits(self, value: float) -> int:
        """Return how many digits a number of the column has, at least one.

        Example:
            >>> NumberFormat(1).digits(104.125), NumberFormat(2, has_powers=True).digits(12345.67)
            (4, 3)
        """
        if self.has_powers:
            return self.decimals + 1
        if value == 0:
            return 1
        if abs(value) >= _LONGEST:
            return _DIGITS_OF_LONG
        return max(floor(log10(abs(value))) + 1 + self.decimals, 1)

    def rounded(self, values: Array) -> Array:
        """Return ``(n,)`` finite numbers as they are written."""
        if not self.has_powers:
            return np.round(values, self.decimals)
        return np.array([float(f"{value:.{self.decimals}e}") for value in values])

    @property
    def pattern(self) -> dict[str, Any]:
        """The format as the page's own code applies it.

        Example:
            >>> NumberFormat(2).pattern
            {'decimals': 2, 'powers': False}
        """
        return {"decimals": self.decimals, "powers": self.has_powers}


def decimals_as_given(values: ArrayLike) -> int:
    """Return the decimals of the values of a column, 0 if some has more than three.

    Differences and limits in sentences have at least as many.

    Example:
        >>> decimals_as_given([38.4, 36.0]), decimals_as_given([1 / 3, 2.0])
        (1, 0)
    """
    return _decimals(_finite(values)) or 0


def needs_logarithms(values: ArrayLike) -> bool:
    """Whether a straight axis would press most values over decades into its first tenth.

    Example:
        >>> needs_logarithms([1, 10, 100]), needs_logarithms([0.001, 0.4, 0.7, 1])
        (True, False)
    """
    finite = _finite(values)
    if not finite.size:
        return False
    low = float(finite.min())
    high = float(finite.max())
    if not 0 < low <= high / LOG_RANGE:
        return False
    return float(np.median(finite)) - low < 0.1 * (high - low)


def _rounded_format(compared: Any, size: float) -> tuple[int, bool]:
    """Return the decimals that tell values apart, and whether they have powers of ten.

    Args:
        compared: The values, finite and not all 0.
        size: The largest of them without its sign.
    """
    low = float(compared.min())
    high = float(compared.max())
    order = log10(size)
    # A constant has no range; its own size then says how many decimals are of use.
    order_of_range = order
    if high > low:
        order_of_range = log10(high / 2 - low / 2) + log10(2)  # no overflow
    if _SHORT <= size < _LONG:
        decimals = max(ceil(log10(_STEPS) - order_of_range), 0)
        if not high / 1e3 > low > 0:
            return decimals, False
        of_least = max(decimals, 1 - floor(log10(low)))  # which has two digits
        if of_least + max(order, 0) < _DIGITS:
            return of_least, False
        if not needs_logarithms(compared):
            return decimals, False
    # Leading digits that all values have in common come on top of three that differ.
    return 2 + max(floor(order) - floor(order_of_range), 0), True


@np.errstate(over="ignore")  # a penalty may be the largest number
def _decimals(finite: Any) -> int | None:
    """Return the decimals, at most three, up to which all values are as given, if there are."""
    for decimals in range(_AS_GIVEN + 1):
        errors = np.abs(finite - np.round(finite, decimals))
        if (errors <= _SAME * np.abs(finite)).all():
            return decimals
    return None


def _finite(values: ArrayLike) -> Any:
    array = np.asarray(values, dtype=np.float64).ravel()
    return array[np.isfinite(array)]


def _with_power(value: float, decimals: int) -> str:
    """Return a number with a power of ten: 1.67e9; 0 is "0"."""
    if value == 0:
        return "0"
    factor, _, power = f"{value:.{decimals}e}".partition("e")
    return f"{factor}e{int(power)}"


def _grouped(text: str) -> str:
    """Return the text of a number with its thousands apart from five digits on."""
    whole, point, decimals = text.partition(".")
    if len(whole.lstrip("-")) >= 5:
        whole = f"{int(whole):,}".replace(",", _APART)
    return f"{whole}{point}{decimals}"


def number(value: float, digits: int = 4, decimals: int = 0, *, mark: str = ".") -> str:
    r"""Return a number with a few digits, but all of those before the point.

    Args:
        value: The number.
        digits: How many digits it has.
        decimals: The least number of decimals, unless it has a power of ten.
        mark: The decimal mark.

    Example:
        >>> number(0.12345), number(1234.5), number(59990.4), number(1.5e12)
        ('0.1235', '1234', '59\xa0990', '1.5e12')
    """
    value = value + 0.0  # no -0
    size = abs(value)
    if size < _LONGEST - 0.5 and (size >= 10**digits - 0.5 or value == round(value)):
        return _grouped(f"{value:.{decimals}f}").replace(".", mark)
    text, _, power = f"{value:.{digits}g}".partition("e")
    if not power and len(text.partition(".")[2]) < decimals:
        text = f"{value:.{decimals}f}"
    text = _grouped(text)
    if power:
        text = f"{text}e{int(power)}"
    return text.replace(".", mark)


def one_sided(
    value: float, is_up: bool, others: ArrayLike, digits: int, decimals: int = 0, mark: str = "."
) -> str:
    """Return the shortest text on one side of a number, which is nearer to it than others are.

    Typed as a limit, it has the effect of the number. One of up to three decimals has all its
    digits, others have all of those before the point.

    Args:
        value: The number.
        is_up: Whether the text must not be less than the number, else not more.
        others: The others; equal ones do not count.
        digits: The least digits.
        decimals: As for :func:`number`.
        mark: The decimal mark.

    Example:
        >>> one_sided(2 / 3, True, [], 4), one_sided(2 / 3, False, [0.66663], 4)
        ('0.6667', '0.66666')
        >>> one_sided(4.000001, True, [4.0], 4), one_sided(0.1 + 0.2, True, [], 4)
        ('4.000001', '0.3001')
    """
    value = float(value)
    distances = np.abs(np.asarray(others, dtype=np.float64) - value)
    nearest = distances[distances > 0].min(initial=np.inf)
    digits = max(digits, len(_given(value).replace(".", "").lstrip("-0")))
    if abs(value) < _LONGEST:
        digits = max(digits, len(str(int(abs(value)))))
    rounding = ROUND_CEILING if is_up else ROUND_FLOOR
    for n_digits in range(digits, _ALL_DIGITS):
        rounded = float(Context(n_digits, rounding).create_decimal(repr(value)))
        if abs(rounded - value) < nearest:
            return number(rounded, n_digits, decimals, mark=mark)
    return number(value, _ALL_DIGITS, decimals, mark=mark)


def as_given(value: float) -> float:
    """Return a number of up to three decimals without the rounding of a calculation.

    Example:
        >>> as_given(10.1 - 0.3), as_given(2 / 3)
        (9.8, 0.6666666666666666)
    """
    return float(_given(value) or value)


def _given(value: float) -> str:
    """Return the text of a number that has up to three decimals but for rounding, else nothing."""
    text = f"{value:.{_SAFE_DIGITS}g}"
    n_decimals = len(text.partition(".")[2])
    if "e" in text or n_decimals > _AS_GIVEN or abs(value) >= 10 ** (_MOST - n_decimals):
        return ""
    return text


def percent(share: float, mark: str = ".") -> str:
    """Return a share with two digits, from 10 % on as a whole number; "—" for NaN.

    Args:
        share: The share of 1.
        mark: The decimal mark.
    """
    if share != share:
        return "—"
    hundreds = 100 * share
    if 0 < hundreds < 0.01:
        text = "less than 0.01 %"
    elif 99.95 <= hundreds < _ALL:
        text = "more than 99.9 %"
    elif 99.5 <= hundreds < 99.95:
        text = f"{hundreds:.3g} %"
    elif hundreds >= 9.95:
        text = f"{hundreds:.0f} %"
    else:
        text = f"{hundreds:.2g} %"
    return text.replace(".", mark)


def percents(shares: Array) -> list[str]:
    """Return ``(n,)`` shares of one whole as whole per cents that add up to 100.

    Those with the largest remainders are rounded up. Shares below 1 % are only said to be so.

    Example:
        >>> percents(np.array([0.83, 0.089, 0.044, 0.0365, 0.0005]))
        ['83 %', '9 %', '4 %', '4 %', 'less than 1 %']
    """
    hundreds = 100 * shares
    whole = np.floor(hundreds)
    remainders = np.round(np.where(hundreds >= 1, hundreds - whole, 0), 9)
    n_up = int(remainders.sum() + 0.5)
    whole[np.argsort(-remainders, kind="stable")[:n_up]] += 1
    texts = []
    for share, rounded in zip(hundreds, whole, strict=True):
        text = f"{rounded:.0f} %"
        if 0 < share < 1:
            text = "less than 1 %"
        elif rounded == 100 and share < _ALL:
            text = "more than 99 %"
        texts.append(text)
    return texts
