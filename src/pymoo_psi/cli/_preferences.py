"""``pymoo-psi prefer``: a few questions in the terminal find the design that a person wants."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path
from typing import TypeAlias

import click
import pandas as pd

from pymoo_psi._numbers import NumberFormat
from pymoo_psi._validation import Received, Values, counted, invalid
from pymoo_psi.analysis import latest_positions
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._console import print_frame, require_output, say
from pymoo_psi.cli._documents import most_violated
from pymoo_psi.cli._source import decision_in, opened, say_source
from pymoo_psi.errors import PsiError
from pymoo_psi.pareto import Preferences
from pymoo_psi.table import Decision, TestTable, entries_of

Answer: TypeAlias = tuple[str, str, str]

_KEYS = "a, b: this one rather; e: equal; s: skip; u: take back; q: end"
_RELATIONS = {"a": ">", "b": ">", "e": "=", "s": "?"}
_N_DIFFERENCES = 12  # columns in which two designs differ, the objectives first
_NOBODY = "me"  # the name of a person who gives none


def run_prefer(options: Options) -> int:
    """Ask which of two designs a person would rather have, and propose one."""
    path = options.file
    _require_decision_file(options.out, path)
    if not options.answers and not sys.stdin.isatty():
        rule = "given where no terminal can be asked"
        raise invalid("--answers", rule, Received("a pipe"), '--answers "A>B, C=D"')
    table = opened(path, options, decision_in(options))
    if not table.feasible().any():
        raise PsiError(f"{path}: no feasible design. {most_violated(table)}")
    dialogue = _Dialogue(table, _person_in(options.person, table.decision), options.out)
    for entry in entries_of(options.answers):
        dialogue.person.add(*_answer_in(entry, table.names))
    say_source(path, table)
    dialogue.say_foreign()
    if options.answers:
        dialogue.save()
    else:
        dialogue.ask()
    say(*dialogue.person.sentences)
    pair = dialogue.person.question()
    if pair is not None:
        _show(table, *pair)
    say(dialogue.kept)
    return 0


class _Dialogue:
    """The questions to one person about a table, and the file that has the answers.

    Attributes:
        person: The answers of the person.
        kept: Where the answers are, as a sentence.
    """

    def __init__(self, table: TestTable, name: str, out: Path | None) -> None:
        self.person = Preferences(table)
        self._table = table
        self._name = name
        self._out = out
        self._foreign: list[Answer] = []  # about designs that are not Pareto optimal here
        for position in latest_positions(table.decision.positions):
            if position["name"] == name:
                self._continue(position["answers"])

    def _continue(self, answers: Sequence[Answer]) -> None:
        """Take former answers; those that do not fit the designs stay in the file."""
        for answer in answers:
            try:
                self.person.add(*answer)
            except PsiError:
                self._foreign.append(answer)

    def say_foreign(self) -> None:
        """Print which former answers do not count."""
        if self._foreign:
            texts = ", ".join(map(_written, self._foreign))
            say(f"Left out, as not about two Pareto-optimal designs of these: {texts}.")

    def ask(self) -> None:
        """Ask until no question is left or the person ends; each answer is saved at once.

        Raises:
            KeyboardInterrupt: The person has pressed Ctrl-C; nothing is lost.
        """
        pair = self.person.question()
        while pair is not None:
            _show(self._table, *pair)
            say(_KEYS)
            try:
                key = _pressed()
            except KeyboardInterrupt:
                raise KeyboardInterrupt(self.kept) from None
            if key == "q":
                return
            if key == "u":
                self.person.take_back()
            elif key == "b":
                self.person.answer(pair[1], pair[0])
            else:
                self.person.add(pair[0], _RELATIONS[key], pair[1])
            self.save()
            say(self.person.sentences[0])
            pair = self.person.question()

    def save(self) -> None:
        """Write the decision, if a file is named."""
        if self._out is None:
            return
        table = self._table
        decision = table.decision
        reason = self.person.sentences[0]
        position: Values = {
            "name": self._name,
            "date": f"{datetime.now(timezone.utc):%Y-%m-%dT%H:%M:%S.%f}"[:-3] + "Z",
            "chosen": self.person.best,
            "limits": {name: limit.plain for name, limit in table.limits.items()},
            "reason": reason,
            "answers": [*self._foreign, *self.person.answers],
        }
        changed = replace(decision, positions=[*decision.positions, position])
        if {one["name"] for one in decision.positions} <= {self._name}:  # nobody else decides
            row = table.row_of(self.person.best)
            values = {name: float(table.column(name)[row]) for name in table.schema.objectives}
            page = decision.page
            if page:
                page = {**page, "values": values}
            changed = replace(changed, chosen=self.person.best, reason=reason, page=page)
        changed.to_json(self._out)

    @property
    def kept(self) -> str:
        """Where the answers are, or how they can be given again."""
        n_answers = counted(len(self.person.answers), "answer")
        if self._out is not None:
            return f"{n_answers} of {self._name} in {self._out}"
        if not self.person.answers:
            return "no answers"
        entries = ", ".join(map(_written, self.person.answers))
        return f"--out FILE.json keeps them: --answers {shlex.quote(entries)}"


def _pressed() -> str:
    """Return the key that answers; the end of the input ends the questions."""
    while True:
        try:
            key = str(click.getchar()).lower()
        except EOFError:
            return "q"
        if key in ("a", "b", "e", "s", "u", "q"):
            return key
        say(_KEYS)


def _show(table: TestTable, one: str, other: str) -> None:
    """Print two designs beside each other, only what differs, the objectives first."""
    schema = table.schema
    rows = [table.row_of(one), table.row_of(other)]
    lines = []
    for name in (*schema.objectives, *schema.outputs, *schema.notes, *schema.variables):
        column = table.column(name)
        if name == schema.label or column[rows[0]] == column[rows[1]]:
            continue
        values = [str(column[row]) for row in rows]
        if column.dtype.kind in "fiu":
            number_format = NumberFormat.of(column)
            values = [number_format.text(column[row]) for row in rows]
        lines.append([schema[name].heading, *values])
    frame = pd.DataFrame(lines, columns=["", f"a: {one}", f"b: {other}"])
    print_frame(frame.head(_N_DIFFERENCES), "Which one would you rather have?")


def _person_in(name: str | None, decision: Decision) -> str:
    """Return the name of the person who answers.

    Raises:
        ArgumentValueError: There are positions of several people, and none is named.
    """
    if name is not None:
        if not name.strip():
            raise invalid("--as", "the name of a person", name)
        return name.strip()
    names = [position["name"] for position in latest_positions(decision.positions)]
    if len(names) > 1:
        raise invalid("--as", "given, as there are several positions", Received(", ".join(names)))
    return str([*names, _NOBODY][0])


def _answer_in(entry: str, names: Sequence[str]) -> Answer:
    """Return the answer of an entry such as ``A>B``; a name may have these signs.

    Raises:
        ArgumentValueError: It is no answer, or may be several.
    """
    answers = []
    for sign in re.finditer(r"[>=?]", entry):
        one = _named(entry[: sign.start()], names)
        other = _named(entry[sign.end() :], names)
        if one and other:
            answers.append((one, sign[0], other))
    if len(answers) != 1:
        rule = "pairs of designs such as A>B, A=B or A?B"
        remedy = "names are those of 'pymoo-psi rank'; one with a comma needs quotation marks"
        raise invalid("--answers", rule, entry, remedy)
    return answers[0]


def _named(text: str, names: Sequence[str]) -> str:
    """Return the name of a design, or of the test with a number; "" if there is none."""
    text = text.strip()
    for name in (text, f"test {text}"):
        if name in names:
            return name
    return ""


def _written(answer: Answer) -> str:
    """Return an answer as an entry of --answers."""
    entry = "".join(answer)
    if "," not in entry and '"' not in entry:
        return entry
    doubled = entry.replace('"', '""')
    return f'"{doubled}"'


def _require_decision_file(out: Path | None, source: Path) -> None:
    """Refuse a file to write that is neither new nor a decision, before anyone is asked.

    Raises:
        ArgumentValueError: It is the source, or has other content than a decision.
        OSError: Its folder does not exist or cannot be written to.
    """
    if out is None or (out.is_file() and out.stat().st_size and _is_decision(out)):
        return
    require_output(out, (".json",), source)


def _is_decision(path: Path) -> bool:
    try:
        Decision.read_json(path)
    except PsiError:
        return False
    return True
