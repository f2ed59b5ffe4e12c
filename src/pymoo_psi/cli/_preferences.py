"""``pymoo-psi prefer``: a few questions in the terminal find the design that a person wants."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path
from typing import TypeAlias

import click

from pymoo_psi._names import named_as
from pymoo_psi._validation import Received, Values, counted, invalid
from pymoo_psi.cli._app import Options
from pymoo_psi.cli._console import cells_of, print_columns, require_output, say
from pymoo_psi.cli._source import opened, require_feasible, say_source
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
    _require_file(out, options)
    table = opened(options.file, options)
    require_feasible(options.file, table)
    former = _former_position(table.decision, options.person)
    person, foreign = _person_of(table, former["answers"])
    answered_before = _counted(person.answers)
    for entry in entries_of(options.answers):
        with named_as({"design": "a design within the limits in --answers"}):
            person.add(*_answer_in(entry, table))
    say_source(table)
    if foreign:
        answers = ", ".join(map("".join, foreign))
        say(f"Left out, as they do not compare two of the Pareto-optimal designs: {answers}.")

    def saved() -> str:
        """Write the decision with the answers of now; the file keeps those of other designs."""
        now = datetime.now(timezone.utc).isoformat(timespec="milliseconds")
        position = former | {"date": now, "answers": [*foreign, *person.answers]}
        _decided(table, position, person, answered_before).to_json(out)
        return f"{counted(len(person.answers), 'answer')} by {former['name']} written to {out}"

    if options.answers:
        kept = saved()
    else:
        kept = _dialogue(person, table, f"No new answers; {out} is not written.", saved)
    say(*person.sentences)
    pair = person.question()
    if options.answers and pair is not None:
        _show(table, *pair)
    say(kept)
    return 0


def _require_file(out: Path, options: Options) -> None:
    """Refuse an output that exists or cannot be written, unless it is the decision continued."""
    if options.decision is not None and out.resolve() == options.decision.resolve():
        return
    if out.is_file():
        rule = "a new file, or that of --decision, which is continued"
        remedy = f"continue it by --decision {shlex.quote(str(out))}, or name another file by --out"
        raise invalid("--out", rule, str(out), remedy)
    require_output(out, (".json",), options.file)


def _former_position(decision: Decision, name: str | None) -> Values:
    """Return the latest position of a person, or one without answers.

    Raises:
        ArgumentValueError: There are positions of several people, and none is named.
    """
    # By name the latest, as positions are in the order of their dates.
    positions = {position["name"]: position for position in decision.positions}
    if not name and len(positions) > 1:
        rule = "given, as there are several positions"
        raise invalid("--as", rule, Received(", ".join(positions)))
    if not name:
        name = [*positions, _NOBODY][0]
    return dict(positions.get(name, {"name": name, "answers": []}))


def _person_of(table: TestTable, answers: list[Answer]) -> tuple[Preferences, list[Answer]]:
    """Return what is known of a person, and the answers about other than Pareto-optimal designs."""
    person = Preferences(table)
    foreign = []
    for answer in answers:
        try:
            person.add(*answer)
        except PsiError:
            foreign.append(answer)
    return person, foreign


def _dialogue(person: Preferences, table: TestTable, kept: str, saved: Callable[[], str]) -> str:
    """Ask until no question is left or the person ends, and say where the answers are.

    Args:
        person: The answers of the person, to which new ones are added.
        table: The designs.
        kept: Where the answers are before the first question.
        saved: Writes the answers, after each of them, and says where.

    Raises:
        KeyboardInterrupt: The person has pressed Ctrl-C; nothing is lost.
    """
    pair = person.question()
    while pair is not None:
        one, other = pair
        _show(table, one, other)
        try:
            key = _pressed()
        except KeyboardInterrupt:
            raise KeyboardInterrupt(kept) from None
        if key == "q":
            break
        if key == "u":
            person.undo()
        elif key == "b":
            person.answer(other, one)
        else:
            person.add(one, _ANSWERS[key], other)
        kept = saved()
        say(person.sentences[0])
        pair = person.question()
    return kept


def _decided(
    table: TestTable, position: Values, person: Preferences, before: list[Answer]
) -> Decision:
    """Return the decision of a table with a position.

    Once the answers say something new, the proposal is the choice of the person, and of the
    decision unless another person has a position.

    Args:
        table: The designs and their decision.
        position: The former position of the person with the answers of now.
        person: The answers of now.
        before: The answers that the person had given before.
    """
    decision = table.decision
    answered = _counted(person.answers)
    choice: Values = {"chosen": person.best, "reason": person.sentences[0]}
    is_proposed = True
    if not answered:  # all are taken back, and so is what was proposed after them
        choice = {"chosen": None, "reason": ""}
        # as the first sentence of a person begins
        is_proposed = position.get("reason", "").startswith("Proposed after")
    if answered != before and is_proposed:
        limits = {name: limit.plain for name, limit in table.limits.items()}
        position = position | {"limits": limits, **choice}
        if {one["name"] for one in decision.positions} <= {position["name"]}:
            decision = _with_choice(decision, choice)
    return replace(decision, positions=[*decision.positions, position])


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
    lines = [["", f"a: {one}", f"b: {other}"]]
    for name in (*schema.objectives, *schema.outputs, *schema.notes, *schema.variables):
        values = table.column(name)[rows]
        if values[0] == values[1] or name == schema.label:
            continue
        lines.append([schema[name].heading, *cells_of(values, formats.get(name))])
    columns = zip(*lines[: 1 + _N_DIFFERENCES], strict=True)
    print_columns([(head, cells) for head, *cells in columns], "Which one would you rather have?")


def _answer_in(entry: str, table: TestTable) -> Answer:
    """Return the answer of an entry such as ``A>B``.

    Raises:
        ArgumentValueError: It is no answer, or one of the designs is unknown.
    """
    answer = re.fullmatch(r"(.+?)([>=?])(.+)", entry)
    if answer is None:
        rule = "pairs of designs such as A>B, A=B or A?B"
        remedy = "names are those of 'pymoo-psi rank'; one with a comma needs quotation marks"
        raise invalid("--answers", rule, entry, remedy)
    one, relation, other = map(str.strip, answer.groups())
    return table.names[table.row_of(one)], relation, table.names[table.row_of(other)]
