r"""Placeholders: where the values of variables belong in the texts of a program.

A placeholder is ``{width}`` or ``{width:.6g}``. Other languages have such braces of their own: a
shell writes ``${width}``, YAML ``{width: 60}``, Python ``f"{width}"``. So anything else between
braces that names a variable is refused. Doubled braces stand for those of the text:
``${{width}}`` becomes ``${width}``.
"""

from __future__ import annotations

import re

from pymoo_psi._validation import Entries, Names, Received, invalid

BRACES = "{name}"

_MARKS = re.compile(r"([^\w\s'\"`\\]+)name([^\w\s'\"`\\:]+)")
# A format of Python that gives a plain number, or s for a text. Its letter is required, as 60 is a
# format, too: {width:60} may be a constant.
_FORMAT = r":[<>^=]?[+-]?#?0?[0-9]{0,3}(?:\.[0-9]{1,3})?[deEfFgGs]"
# What makes braces those of a shell or of an f-string; three on each side could be either.
_FOREIGN = (
    r"\$|\{\{(?=\{[^{}]*\}\}\})"
    r"|(?<!\w)[rR]?[fF][rR]?(?:(?P<three>\"{3}|'{3})(?:(?!(?P=three))[\s\S])*?"
    r"|(?P<one>[\"'])(?:(?!(?P=one)).)*?)(?<!\{)"
)


class Placeholders:
    """The placeholders of some variables.

    Args:
        marks: How a placeholder is written, such as ``{name}``.
        names: The variables.

    Attributes:
        used: The variables of the placeholders that have been filled.
    """

    def __init__(self, marks: str, names: Names) -> None:
        parts = _MARKS.fullmatch(marks)
        if parts is None:
            rule = "'name' between marks that are no letters, digits, blanks or quotation marks"
            raise invalid("marks", rule, marks, "write them such as '@name@'")
        self.marks = marks
        self.used: set[str] = set()
        before, after = map(re.escape, parts.groups())
        name = rf"(?<!\w)(?:{'|'.join(names)})(?!\w)"
        inside = rf"(?!{before}|{after})."  # of the marks
        # Texts between quotation marks name no variable.
        above = rf"(?:\"(?:(?!\"){inside})*\"|'(?:(?!'){inside})*'|(?![\"']){inside})*?"
        rest = f"(?:{inside})*{after}"
        naming = f"{before}(?={rest}){above}{name}{rest}"  # looking ahead keeps the time linear
        foreign = "(?!)"
        if marks == BRACES:
            foreign = _FOREIGN
        self._pattern = re.compile(
            f"{before}(?P<literal>{naming}){after}"
            f"|(?:{foreign}){naming}"
            f"|{before}(?P<name>{name})(?P<format>{_FORMAT})?{after}"
            f"|{naming}"
        )

    def fill(self, where: str, text: str, values: Entries) -> str:
        """Return a text with values for its placeholders.

        Args:
            where: Name of the text.
            text: The text.
            values: The value of each variable by name.

        Raises:
            ArgumentValueError: Something in it could be a placeholder, or a format does not fit.
        """

        def value(match: re.Match[str]) -> str:
            if match["literal"]:
                return match["literal"]
            problem = ""
            if match["name"]:
                self.used.add(match["name"])
                try:
                    return format(values[match["name"]], (match["format"] or "")[1:])
                except ValueError as error:
                    problem = f" ({error})"
            number = text.count("\n", 0, match.end()) + 1
            raise invalid(
                f"{where}, line {number}: a placeholder",
                f"{self.marks} or {self.marks.replace('name', 'name:FORMAT')} with a format such "
                "as .6g, 08.3f or, for integers, d; braces without $ before, and in no f-string",
                Received(f"{match[0]!r:.60}{problem}"),
                "double the marks if they belong to the text, as {{x}} stands for {x}, or choose "
                "others in [program], such as marks = '@name@'",
            )

        return self._pattern.sub(value, text)
