"""``pymoo-psi prefer``: a few questions in the terminal find the design that a person wants."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path
from typing import TypeAlias

import click
import pandas as pd

from pymoo_psi._names import named_as
from pymoo_psi._validation import Received, Values, counted, invalid
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._console import print_frame, require_output, say
from pymoo_psi.cli._source import decision_in, opened, require_feasible, say_source
from pymoo_psi.errors import PsiError
from pymoo_psi.page import number_formats
from pymoo_psi.pareto import Preferences
from pymoo_psi.table import Decision, TestTable, entries_of

Answer: TypeAlias = tuple[str, str, str]

_KEYS = "a or b: this design; e: equally good; s: skip; u: undo the last answer; q: quit"
_ANSWERS = {"a": ">", "b": ">", "e": "=", "s": "?"}
_N_DIFFERENCES = 12  # columns in which two designs differ, the objectives first
_NOBODY = "me"  # the name of a person who gives none


def run_prefer(options: Options) -> int:
    """Ask which of two designs a person would rather have, and propose one."""
    out = options.out
    if options.decision is None or out.resolve() != options.decision.resolve():
        if out.is_file():
            rule = "a new file, or that of --decision, which is continued"
            raise invalid("--out", rule, str(out))
        require_output(out, (".json",), options.file)
    table = opened(options.file, options, decision_in(options))
    require_feasible(options.file, table)
    dialogue = _Dialogue(table, options.person, out)
    for entry in entries_of(options.answers):
        dialogue.person.add(*_answer_in(entry, table))
    say_source(table)
    if dialogue.foreign:
        answers = ", ".join(map("".join, dialogue.foreign))
        say(f"Left out, as they do not compare two of the Pareto-optimal designs: {answers}.")
    if options.answers:
        dialogue.save()
    else:
        dialogue.ask()
    say(*dialogue.person.sentences)
    pair = dialogue.person.question()
    if options.answers and pair is not None:
        _show(table, *pair)
    say(dialogue.kept)
    return 0


class _Dialogue:
    """The questions to one person about a table, and the file that keeps the answers.

    Attributes:
        person: The answers of the person.
        foreign: Former answers about other designs than the Pareto-optimal ones; the file keeps
            them.
        kept: Where the answers are, as a sentence.
    """

    def __init__(self, table: TestTable, name: str | None, out: Path) -> None:
        """Take the former position of a person.

        Raises:
            ArgumentValueError: There are positions of several people, and none is named.
        """
        # By name the latest, as positions are in the order of their dates.
        former = {position["name"]: position for position in table.decision.positions}
        if name is None:
            if len(former) > 1:
                rule = "given, as there are several positions"
                raise invalid("--as", rule, Received(", ".join(former)))
            name = [*former, _NOBODY][0]
        self.person = Preferences(table)
        self.foreign: list[Answer] = []
        self.kept = f"No new answers; {out} is not written."
        self._table = table
        self._out = out
        self._former = former.get(name, {"name": name, "answers": []})
        for answer in self._former["answers"]:
            try:
                self.person.add(*answer)
            except PsiError:
                self.foreign.append(answer)
        self._counted = _counted(self.person.answers)

    def ask(self) -> None:
        """Ask until no question is left or the person ends; each answer is saved at once.

        Raises:
            KeyboardInterrupt: The person has pressed Ctrl-C; nothing is lost.
        """
        pair = self.person.question()
        while pair is not None:
            one, other = pair
            _show(self._table, one, other)
            try:
                key = _pressed()
            except KeyboardInterrupt:
                raise KeyboardInterrupt(self.kept) from None
            if key == "q":
                return
            if key == "u":
                self.person.undo()
            elif key == "b":
                self.person.answer(other, one)
            else:
                self.person.add(one, _ANSWERS[key], other)
            self.save()
            say(self.person.sentences[0])
            pair = self.person.question()

    def save(self) -> None:
        """Write the decision: the former position of the person with the answers of now.

        Once these say something new, the proposal is the choice of the person, and of the decision
        unless another person has a position.
        """
        decision = self._table.decision
        name = self._former["name"]
        answers = self.person.answers
        position = {
            **self._former,
            "date": datetime.now(timezone.utc).isoformat(timespec="milliseconds"),
            "answers": [*self.foreign, *answers],
        }
        answered = _counted(answers)
        choice: Values = {"chosen": self.person.best, "reason": self.person.sentences[0]}
        is_proposed = True
        if not answered:  # all are taken back, and so is what was proposed after them
            choice = {"chosen": None, "reason": ""}
            # as the first sentence of a person begins
            is_proposed = position.get("reason", "").startswith("Proposed after")
        if answered != self._counted and is_proposed:
            limits = {name: limit.plain for name, limit in self._table.limits.items()}
            position |= {"limits": limits, **choice}
            if {one["name"] for one in decision.positions} <= {name}:
                decision = _with_choice(decision, choice)
        replace(decision, positions=[*decision.positions, position]).to_json(self._out)
        n_answers = counted(len(answers), "answer")
        self.kept = f"{n_answers} by {name} written to {self._out}"


def _counted(answers: list[Answer]) -> list[Answer]:
    """Return the answers that say something: a skipped question does not."""
    return [answer for answer in answers if answer[1] != "?"]


def _with_choice(decision: Decision, choice: Values) -> Decision:
    """Return a decision with a design and a reason; another design ends what a group decided."""
    if choice["chosen"] != decision.chosen:
        page = dict(decision.page)
        page.pop("values", None)  # of the design that was chosen before
        decision = replace(decision, decided=None, page=page)
    return replace(decision, **choice)


def _pressed() -> str:
    """Return the key that answers; the end of the input ends the questions."""
    while True:
        say(_KEYS)
        try:
            key = click.getchar().lower()
        except EOFError:
            return "q"
        except OSError as error:
            raise PsiError("prefer asks in a terminal; without one, use --answers") from error
        if key in (*_ANSWERS, "u", "q"):
            return key


def _show(table: TestTable, one: str, other: str) -> None:
    """Print two designs beside each other, only what differs, the objectives first."""
    schema = table.schema
    formats = number_formats(table)
    rows = [table.row_of(one), table.row_of(other)]
    lines = []
    for name in (*schema.objectives, *schema.outputs, *schema.notes, *schema.variables):
        values = table.column(name)[rows]
        if values[0] == values[1] or name == schema.label:
            continue
        text = formats[name].text if name in formats else str
        lines.append([schema[name].heading, *map(text, values)])
    frame = pd.DataFrame(lines, columns=["", f"a: {one}", f"b: {other}"])
    print_frame(frame.head(_N_DIFFERENCES), "Which one would you rather have?")


def _answer_in(entry: str, table: TestTable) -> Answer:
    """Return the answer of an entry such as ``A>B``; a name may have these signs.

    Raises:
        ArgumentValueError: It is no answer, or may be several, or one of the designs is unknown or
            infeasible.
    """
    answers = []
    signs = list(re.finditer("[>=?]", entry))
    for sign in signs:
        pair = [entry[: sign.start()].strip(), entry[sign.end() :].strip()]
        try:
            with named_as({"design": "a design in --answers"}):
                rows = [table.row_of(design) for design in pair]
        except PsiError:
            if len(signs) == 1:
                raise
            continue
        answers.append((rows, sign[0]))
    if len(answers) != 1:
        rule = "pairs of designs such as A>B, A=B or A?B"
        remedy = "names are those of 'pymoo-psi rank'; one with a comma needs quotation marks"
        raise invalid("--answers", rule, entry, remedy)
    rows, relation = answers[0]
    for row in rows:
        if table.status[row] != "ok":
            received = Received(f"{table.names[row]}, which is {table.status[row]}")
            raise invalid("--answers", "about designs within the limits", received)
    one, other = [table.names[row] for row in rows]
    return one, relation, other
