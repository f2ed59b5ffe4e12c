"""Tables for readers: HTML whose names are data, LaTeX that prints just the names and numbers."""

import re
import shutil
import string
import subprocess
import xml.etree.ElementTree as ET

import numpy as np
import pandas as pd
import pytest
from pymoo.problems import get_problem

from pymoo_psi import TestTable, compare, representatives
from pymoo_psi._tables import ROWS, latex_table
from pymoo_psi.page import decision_page
from pymoo_psi.paper import Reproduction, solve_case
from pymoo_psi.selection import SalukvadzeOptimum, compare_selectors
from pymoo_psi.table import Layout, convergence

EVIL = "<b>cost</b> & \"co\" <script>alert('1')</script>"


@pytest.fixture(scope="module")
def table():
    rng = np.random.default_rng(3)
    layout = Layout.of(["width"], [EVIL, "gain"], maximize=["gain"], units={"width": "mm<i>"})
    F = np.column_stack([np.arange(40.0), -(np.arange(40.0) ** 2)])
    return TestTable.of(1 + np.arange(40), rng.random((40, 1)), F, layout=layout)


@pytest.fixture(scope="module")
def comparison():
    algorithms = {EVIL: "psi", "psi": "psi"}
    return compare(get_problem("bnh"), n_evaluations=16, algorithms=algorithms, polish=False)


def shown(thing):
    """The page that a notebook shows, as elements; markup from names would be among them."""
    page = ET.fromstring(f"<div>{thing._repr_html_().replace('scoped', '')}</div>")
    tags = {element.tag for element in page.iter()}
    assert tags <= {"div", "p", "style", "table", "thead", "tbody", "tr", "th", "td"}
    rows = [[cell.text or "" for cell in row] for row in page.iter("tr")]
    return " ".join(p.text for p in page.iter("p")), rows


def frame_of(table):
    columns = table.layout.objectives
    return pd.DataFrame({name: table.column(name) for name in columns})


@pytest.mark.parametrize(
    "view",
    [
        lambda t: t,
        lambda t: t.ranking(),
        lambda t: convergence(t),
        lambda t: representatives(frame_of(t), 3, maximize=["gain"]),
        lambda t: compare_selectors(frame_of(t), {EVIL: SalukvadzeOptimum()}),
    ],
)
def test_names_are_data_in_a_notebook(table, view):
    text, rows = shown(view(table))
    assert text.startswith(type(view(table)).__name__)
    assert 1 < len(rows) <= ROWS + 2
    assert EVIL in text + " ".join(" ".join(row) for row in rows) or "Convergence" in text


def test_a_comparison_is_shown_with_the_users_names(comparison):
    text, rows = shown(comparison)
    assert [row[2] for row in rows] == ["algorithm", EVIL, "psi"]


def test_a_page_is_framed_whole_and_kept_from_the_notebook(table):
    page = decision_page(table, title=EVIL)
    (frame,) = ET.fromstring(f"<div>{page._repr_html_()}</div>")
    assert frame.tag == "iframe"
    assert frame.get("srcdoc").split() == page.html().split()  # XML makes spaces of line ends
    assert "allow-same-origin" not in frame.get("sandbox")


def test_of_a_long_table_the_first_rows_are_shown_with_units_and_said_to_be_the_first(table):
    text, (heading, _, *rows) = shown(table)
    assert f"The first {ROWS} of 40 rows" in text
    assert heading == ["", "width [mm<i>]", EVIL, "gain (max)", "status"]
    assert [row[0] for row in rows] == [str(n) for n in range(1, 1 + ROWS)]


# LaTeX


def cells(latex):
    lines = latex.splitlines()
    assert lines[0].startswith(r"\begin{tabular}{")
    assert (lines[1], lines[3]) == (r"\toprule", r"\midrule")
    assert lines[-2:] == [r"\bottomrule", r"\end{tabular}"]
    rows = [line.removesuffix(r" \\") for line in (lines[2], *lines[4:-2])]
    rows = [re.split(r"(?<!\\) & ", row) for row in rows]
    assert {len(row) for row in rows} == {len(lines[0]) - len(r"\begin{tabular}{}")}
    return rows


def test_numbers_of_a_column_have_decimals_that_tell_them_apart():
    columns = {
        "far": ([1000.01, 1000.03, 1000.02], ("1000.0100", "1000.0300", "1000.0200")),
        "wide": ([0.001234, 4.4, -12.0], ("0.00", "4.40", "-12.00")),
        "whole": ([1.0, 20.0, -0.0], ("1", "20", "0")),
        "tiny": ([1.25e-11, 3e-9, float("inf")], ("1.25e-11", "3e-09", "inf")),
        "gap": ([0.5, float("nan"), 0.25], ("0.5000", "nan", "0.2500")),
        "% of_N": (["a&b", 1, "c"], (r"a\&b", "1", "c")),
    }
    latex = latex_table((name, values) for name, (values, _) in columns.items())
    heading, *rows = cells(latex)
    assert heading == [*list(columns)[:-1], r"\% of\_N"]
    assert list(zip(*rows, strict=True)) == [texts for _, texts in columns.values()]
    assert "{rrrrrl}" in latex


def test_tables_are_those_of_the_tests(table):
    _, *rows = cells(table.rows([4, 2]).to_latex(["gain"]))
    assert rows == [["5", "16"], ["3", "4"]]


def test_tables_without_rows_have_their_headings(table):
    assert cells(table.rows([]).to_latex(["gain"])) == [["test point", "gain (max)"]]
    nothing = Reproduction(8, (solve_case(0.4, "full", 8),)).to_latex("6.2")
    assert len(cells(nothing)) == 1  # no design of rank 5 is cheaper than the optimum


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex")
def test_tables_compile(table, comparison, tmp_path):
    odd = latex_table([(string.punctuation, [string.punctuation, 1]), ("f1", [1.5, float("nan")])])
    head = r"\documentclass{article}\usepackage{booktabs}\begin{document}"
    tables = [table.to_latex(), comparison.to_latex(), odd, r"\end{document}"]
    (tmp_path / "t.tex").write_text(head + "\n\n".join(tables), "utf-8")
    command = ["pdflatex", "-halt-on-error", "-interaction=nonstopmode", "t.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, errors="replace")
    assert done.returncode == 0, done.stdout[-2000:]
