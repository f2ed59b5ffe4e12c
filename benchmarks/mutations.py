"""Small faults put into core modules, and whether the tests notice each.

    python -m benchmarks.mutations [MUTANTS [SEED [RESULTS.jsonl]]]

A mutant changes one place of one file: a comparison, an operator, a condition, a number, the order
of two arguments, or a call without a result, which is left out. First all tests run once, which
tells those that execute each line (coverage with contexts). Of a mutant, the tests are tried that
execute its line; then the whole files of those whose fixtures do, as other tests share these; or
the tests of its subpackage, where a line runs on import or in other processes only. In the end,
all tests are tried on the mutants that are left, then the slow ones of their subpackages, and those
are listed that none noticed. Results are kept in a file, by which an interrupted study continues.
"""

from __future__ import annotations

import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from coverage import CoverageData

from benchmarks.machine import QUICK, describe_machine, sized

CHECKOUT = Path(__file__).parents[1]
SOURCES = Path("src", "pymoo_psi")
CORE = (
    "chute",
    "sequences",
    "pareto",
    "table",
    "study",
    "analysis",
    "selection",
    "algorithms",
    "comparison",
)
LIMIT = 1800  # seconds for all tests of a mutant: one that never ends is noticed
COMPARISONS = {
    ast.Lt: "<=",
    ast.LtE: "<",
    ast.Gt: ">=",
    ast.GtE: ">",
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.Is: "is not",
    ast.IsNot: "is",
    ast.In: "not in",
    ast.NotIn: "in",
}
OPERATORS = {
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "/",
    ast.Div: "*",
    ast.BitAnd: "|",
    ast.BitOr: "&",
}


class Mutant(NamedTuple):
    """A change of one place: the file, the place in its lines, what stands there and what will."""

    file: str
    line: int
    former: str
    new: str
    start: int
    end: int

    @property
    def key(self) -> str:
        """The mutant in one line."""
        return f"{self.file}:{self.line}: {self.former}  ->  {self.new}"


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Yield all mutants of a file."""
    source = path.read_bytes()
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for node in _code(ast.parse(source)):
        for replaced, new in _changes(node):
            assert replaced.end_lineno is not None
            assert replaced.end_col_offset is not None
            start = starts[replaced.lineno - 1] + replaced.col_offset
            end = starts[replaced.end_lineno - 1] + replaced.end_col_offset
            former = " ".join(source[start:end].decode().split())
            name = str(path.relative_to(CHECKOUT))
            yield Mutant(name, replaced.lineno, former, new, start, end)


def _code(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of what runs: neither annotations nor messages of errors."""
    for name, value in ast.iter_fields(tree):
        if name in ("annotation", "returns") or isinstance(tree, (ast.Raise, ast.AnnAssign)):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield child
                yield from _code(child)


def _changes(node: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    """Yield the changes of a node: what is replaced, and by what."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        left = ast.unparse(node.left)
        right = ast.unparse(node.comparators[0])
        yield node, f"({left}) {COMPARISONS[type(node.ops[0])]} ({right})"
    elif isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        left = ast.unparse(node.left)
        right = ast.unparse(node.right)
        yield node, f"(({left}) {OPERATORS[type(node.op)]} ({right}))"
    elif isinstance(node, ast.BoolOp):
        word = " or " if isinstance(node.op, ast.And) else " and "
        yield node, f"({word.join(f'({ast.unparse(value)})' for value in node.values)})"
    elif isinstance(node, (ast.If, ast.IfExp, ast.While)):
        yield node.test, f"(not ({ast.unparse(node.test)}))"
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        yield node, repr(node.value + 1)
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        yield node, "pass"
    elif isinstance(node, ast.Call) and len(node.args) > 1:
        arguments = [node.args[1], node.args[0], *node.args[2:], *node.keywords]
        call = ", ".join(map(ast.unparse, arguments))
        yield node, f"{ast.unparse(node.func)}({call})"


def drawn(n: int, seed: int) -> list[Mutant]:
    """Return n different mutants of the core, each place as likely as any other."""
    every: list[Mutant] = []
    sources = CHECKOUT / SOURCES
    for path in sorted(sources.rglob("*.py")):
        if path.relative_to(sources).parts[0].removesuffix(".py") in CORE:
            every += mutants_of(path)
    return random.Random(seed).sample(every, n)


class Contexts:
    """The tests that execute each line of the checkout.

    Args:
        file: File of coverage with the contexts of all tests; they run if there is none.
    """

    def __init__(self, file: Path) -> None:
        if not file.exists():
            words = ["--cov", "--cov-context=test", "--cov-report=", "tests", "src"]
            if QUICK:
                words[-2:] = ["tests/sequences"]
            environment = {**os.environ, "COVERAGE_FILE": str(file)}
            ended = tried(CHECKOUT, words, environment)
            if ended.returncode:
                raise RuntimeError(f"the tests fail without a mutant: {ended.stdout[-500:]}")
        self._data = CoverageData(str(file))
        self._data.read()

    def of(self, mutant: Mutant) -> Iterator[list[str]]:
        """Yield the tests to try on a mutant, those first that are likeliest to notice it."""
        contexts: set[str] = set()
        for file in self._data.measured_files():
            if file.endswith(mutant.file):
                contexts.update(self._data.contexts_by_lineno(file).get(mutant.line, ()))
        tests = {name.rpartition("|")[0] for name in contexts if name.endswith("|run")}
        files = {name.partition("::")[0] for name in contexts if name.endswith("|setup")}
        if tests:
            yield sorted(tests)
        if files:
            yield sorted(files)
        if not tests and not files:
            yield own_tests(mutant)


def own_tests(mutant: Mutant) -> list[str]:
    """Return where the tests of a mutant's subpackage are."""
    subpackage = Path(mutant.file).parts[2].removesuffix(".py")
    return [f"tests/{subpackage}", str(Path(*Path(mutant.file).parts[:3]))]


def tried(
    checkout: Path, words: list[str], environment: dict[str, str]
) -> subprocess.CompletedProcess[str]:
    """Return how pytest ended in a checkout."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "2", "--no-header", *words]
    environment = {**environment, "PYTHONPATH": str(checkout / "src"), "CI": "1"}
    return subprocess.run(
        command, cwd=checkout, env=environment, capture_output=True, text=True, timeout=LIMIT
    )


def noticed_by(mutant: Mutant, groups: Iterable[list[str]]) -> str:
    """Return the first line of the tests' complaint on a mutant; nothing if they all pass.

    Args:
        mutant: The mutant.
        groups: Tests or their files, tried in this order.
    """
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "checkout")
        hidden = shutil.ignore_patterns(".git", ".tox", "*cache*", "runs", ".coverage*")
        shutil.copytree(CHECKOUT, copy, ignore=hidden)
        path = copy / mutant.file
        source = path.read_bytes()
        path.write_bytes(source[: mutant.start] + mutant.new.encode() + source[mutant.end :])
        for tests in groups:
            try:
                ended = tried(copy, tests, dict(os.environ))
            except subprocess.TimeoutExpired:
                return "it did not end"
            if ended.returncode not in (0, pytest.ExitCode.NO_TESTS_COLLECTED):
                lines = ended.stdout.splitlines()
                failed = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
                return (failed or lines[-1:] or ["an error"])[0][:150]
    return ""


def main(n: int = sized(100, 1), seed: int = 1, results: str = "") -> None:
    """Try mutants, and print the share that is noticed and those that are not."""
    print(describe_machine())
    known: dict[tuple[str, str], str] = {}
    file = Path(results) if results else Path(tempfile.mkdtemp(), "mutations.jsonl")
    if file.exists():
        for line in file.read_text("utf-8").splitlines():
            key, tests, complaint = json.loads(line)
            known[key, tests] = complaint
    contexts = Contexts(file.with_suffix(".coverage"))
    mutants = drawn(n, seed)

    def survivors(tests: str) -> list[Mutant]:
        """Try the mutants that are left, and return those that no test noticed."""
        left = []
        for mutant in mutants:
            if (mutant.key, tests) not in known:
                groups: Iterable[list[str]] = [["tests", "src"], ["-m", "slow", *own_tests(mutant)]]
                if tests == "of its line":
                    groups = contexts.of(mutant)
                known[mutant.key, tests] = noticed_by(mutant, groups)
                with file.open("a", encoding="utf-8") as stream:
                    stream.write(json.dumps([mutant.key, tests, known[mutant.key, tests]]) + "\n")
                print(f"{mutant.key}\n    {known[mutant.key, tests] or 'NOT NOTICED'}", flush=True)
            if not known[mutant.key, tests]:
                left.append(mutant)
        return left

    mutants = survivors("of its line")
    print(f"{n - len(mutants)} of {n} mutants noticed by tests that execute their line")
    if not QUICK:
        mutants = survivors("all")
    print(f"{n - len(mutants)} of {n} mutants noticed (seed {seed})")
    print("\n".join(mutant.key for mutant in mutants))


if __name__ == "__main__":
    arguments = sys.argv[1:]
    main(
        *(int(word) for word in arguments[:2]),  # type: ignore[misc]
        **({"results": arguments[2]} if len(arguments) > 2 else {}),
    )
