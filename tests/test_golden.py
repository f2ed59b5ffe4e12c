"""Whole sessions of the command, word by word, number by number.

``golden/sessions.toml`` lists the command lines of each session; ``golden/NAME.txt`` is its
transcript: exit codes, both streams and the tables written. Each runs in a copy of
``golden/inputs``. Numbers have ten digits here. Figures are not drawn.

After a change that is meant, record again and review the difference::

    python -m tests.test_golden [NAME ...]
    git diff tests/golden
"""

from __future__ import annotations

import html
import io
import json
import re
import shlex
import shutil
import sys
import tempfile
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from pymoo_psi.cli import main
from tests.helpers.drawn import saved_empty

if sys.version_info >= (3, 11):
    import tomllib
else:
    tomllib = pytest.importorskip("tomli")

FOLDER = Path(__file__).parent / "golden"
SESSIONS = tomllib.loads((FOLDER / "sessions.toml").read_text("utf-8"))
# The headings and paragraphs of a document, without its tables, figures and scripts.
BLOCK = re.compile(r"<(h1|h2|h3|p|li|figcaption)\b[^>]*>(.*?)</\1>", re.DOTALL)


def untimed(text):
    """A comparison's table without its columns of seconds."""
    if "seconds" not in text.partition("\n")[0]:
        return text
    rows = [line.split(",") for line in text.splitlines()]
    return "\n".join(
        ",".join(cell for head, cell in zip(rows[0], row, strict=True) if "seconds" not in head)
        for row in rows
    )


def readable(path):
    """What the transcript holds of a written file."""
    if path.suffix not in (".csv", ".json", ".html"):
        return ""
    text = path.read_text("utf-8")
    if path.name.endswith("-metadata.json"):
        entries = json.loads(text).items()
        return "\n".join(
            f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in entries
        )
    if path.suffix != ".html":
        return untimed(text) if path.suffix == ".csv" else text
    if "<script" in text:  # which makes what is read
        return ""
    sentences = [
        html.unescape(re.sub("<.*?>", "", block)).split() for _, block in BLOCK.findall(text)
    ]
    return "\n".join(" ".join(words) for words in sentences if words)


def normalized(text, folder):
    """Without places, times and digits that differ from machine to machine."""
    text = text.replace(str(folder), "FOLDER")
    text = re.sub(r"\d{4}-\d\d-\d\d([T ]\d\d:\d\d(:\d\d(\.\d+)?)?)?", "DATE", text)
    text = re.sub(r"^( *\d+ +psi\S* .* )\d\.\d{4}$", r"\1SECONDS", text, flags=re.MULTILINE)
    text = re.sub(r"pymoo-psi \d+(\.\w+)+", "pymoo-psi VERSION", text)
    text = re.sub(r"-?\d+\.\d{9,}(e[-+]?\d+)?", lambda found: f"{float(found[0]):.10g}", text)
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())


@contextmanager
def workplace(folder):
    """The inputs in a folder, as seen from a pipe; figures take no time."""
    shutil.copytree(FOLDER / "inputs", folder, dirs_exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.syspath_prepend(str(folder))
        patch.setenv("COLUMNS", "100")
        patch.setenv("NO_COLOR", "1")
        patch.setattr(Figure, "savefig", saved_empty)
        yield
    sys.modules.pop("cantilever", None)


def stamps(folder):
    return {path: path.stat().st_mtime_ns for path in sorted(folder.rglob("*")) if path.is_file()}


def transcript(lines, folder):
    """Run command lines one after the other; return all that they leave behind."""
    parts = []
    with workplace(folder):
        for line in lines:
            before, out, err = stamps(folder), io.StringIO(), io.StringIO()
            with redirect_stdout(out), redirect_stderr(err):
                code = main(shlex.split(line))
            parts += [f"$ pymoo-psi {line}\n", out.getvalue()]
            if errors := err.getvalue():
                parts += ["--- stderr\n", errors]
            parts.append(f"--- exit {code}\n")
            for path, stamp in stamps(folder).items():
                if "__pycache__" in path.parts or before.get(path) == stamp:
                    continue
                parts += [f"--- {path.relative_to(folder)}\n", readable(path), "\n"]
            parts.append("\n")
    return normalized("".join(parts), folder)


# Their numbers are of other libraries, too: resampling and random numbers of recent releases of
# SciPy and pymoo.
RECENT = {"algorithms", "study"}


@pytest.mark.parametrize("name", SESSIONS)
def test_a_session_is_what_it_was(name, tmp_path):
    if name in RECENT and np.lib.NumpyVersion(np.__version__) < "2.0.0":
        pytest.skip("recorded with recent releases of other libraries")
    recorded = (FOLDER / f"{name}.txt").read_text("utf-8")
    assert transcript(SESSIONS[name], tmp_path) == recorded


if __name__ == "__main__":
    for name in sys.argv[1:] or SESSIONS:
        with tempfile.TemporaryDirectory() as folder:
            text = transcript(SESSIONS[name], Path(folder).resolve())
        (FOLDER / f"{name}.txt").write_text(text, "utf-8")
