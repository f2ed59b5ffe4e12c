"""The page of a study that grows, to watch and steer a run in a browser.

:func:`live` shows a study in a notebook and returns the address of its page; the command
``pymoo-psi live`` does the same in a terminal. Both need the extra ``live``.

It is the decision page. A server in a separate process reads the study when it has changed and
sends new designs as server-sent events; the page ranks them. Requests to the run are stored in the
study, and the run reads them between two proposals. The run does not depend on page or server: it
may be on another machine, and continues when they end.

The server listens on 127.0.0.1. Its address contains a token. Requests from other pages or for
other host names are refused, and the size of requests is bounded. The server accesses only the
study and the file with the token beside it.
"""

from __future__ import annotations

import asyncio
import json
import os
import secrets
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from dataclasses import replace
from html import escape
from pathlib import Path
from platform import node
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

import numpy as np

from pymoo_psi._output import whole_file
from pymoo_psi._validation import FilePath, Values, known_name
from pymoo_psi.analysis import alike
from pymoo_psi.errors import PsiError
from pymoo_psi.files import stored_tests
from pymoo_psi.page import designs_of_page, page_of_tests, rows_of
from pymoo_psi.study import ACTIONS, LAST, LASTING, Facts, Study, further_tests
from pymoo_psi.table import Decision, TestTable

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.types import ASGIApp

__all__ = ["live"]

_HOST = "127.0.0.1"
_PORT = 8741  # the port, unless it is taken
_PAUSE = 0.5  # seconds between two looks at the study
_GROWTH = 4  # times as many tests begin another edition
_SHOWN = 20  # requests that the page lists, the last ones
_LONGEST = 2**18  # bytes of a request
# Notebooks show the page in a frame.
_FRAMES = "http://127.0.0.1:* http://localhost:* vscode-webview:"
_HEADERS = {
    "Content-Security-Policy": f"frame-ancestors {_FRAMES}",
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class GrowingStudy:
    """The tests of a study in the order of their arrival, and the page of them.

    Pages of one ``edition`` differ in the number of their tests alone, and the next tests are added
    to them. Another edition begins when stored tests or columns have changed, and when there are
    four times as many tests: a page made anew has the digits and the scales that tell them apart.
    One thread looks; others may ask meanwhile.

    Attributes:
        tests: The tests, without limits.
        edition: Name of the edition.
        progress: What the page says of the run.
    """

    def __init__(self, path: Path, *, steer: bool) -> None:
        self.study: Study = Study(path)
        self.tests: TestTable = TestTable.empty()
        self.edition: str = ""
        self.progress: Values = {"lines": []}
        self._steer = steer
        self._facts = Facts({})
        self._limits: Any = {}
        self._modified = 0  # time of the file that was read
        self._key = ""  # what all tests of the edition have in common
        self._n_first = 0  # tests with which the edition began
        self._n_left = 0  # planned tests that are not done
        self._pages: dict[str, str] = {}  # the page made last, by its edition

    def look(self) -> None:
        """Read what is new in the study."""
        is_running = True
        try:
            state = os.stat(self.study.path)  # before it is read, so that nothing is missed
            if state.st_mtime_ns != self._modified:
                self._read()
                self._modified = state.st_mtime_ns
            sentence, is_running = self._state(time.time() - state.st_mtime)
            lines = [self._counts(), sentence]
        except (OSError, PsiError) as error:
            lines = [str(error)]
        self.progress = {
            "tests": len(self.tests),
            "lines": lines,
            "is_running": is_running,
            "steered": self._facts.requests[-_SHOWN:],
        }

    def _read(self) -> None:
        """Read new tests, or all of them for another edition."""
        tests = self.tests
        with self.study.reading() as database:
            facts = database.facts
            numbers = database.test_numbers()
            key = repr([facts.head, len(facts.runs), facts.n_changes])
            if key != self._key:
                tests = TestTable.empty()
            new = numbers[~np.isin(numbers, tests.numbers)]
            first, last = new.min(initial=LAST), new.max(initial=0)
            columns = database.tests(int(first), int(last))
            self._n_left = database.n_left()
        stored = stored_tests(facts, columns)
        table = replace(stored, decision=Decision(), remarks=())
        self._facts = facts
        self._limits = stored.formulation.limits
        self.tests = tests.extended(table.take(np.isin(table.numbers, new)))
        if key != self._key or len(self.tests) >= _GROWTH * self._n_first:
            self._key = key
            self._n_first = len(self.tests)
            self.edition = secrets.token_hex(4)

    def page(self) -> str:
        """Return the page, which may lack the last tests; empty without a feasible design."""
        # The edition first: if the tests are those of the next one, the page is loaded anew.
        edition = self.edition
        tests = self.tests
        text = self._pages.get(edition, "")
        designs = designs_of_page(tests)
        if not text and len(designs):
            path = Path(self.study.path)
            page = page_of_tests(tests.under(limits=self._limits), designs, path.stem, path.name)
            place = f"{edition}-{len(tests)}"
            text = page.html({"from": place, "count": len(tests), "steer": self._steer})
            self._pages = {edition: text}
        return text

    def _counts(self) -> str:
        """Return how many tests there are, and why most of the failed ones did."""
        n_tests = len(self.tests)
        reasons = Counter(alike(self.tests.reasons.values())).most_common(3)
        failures = [f"failed {n} × {reason:.80}" for reason, n in reasons]
        return ", ".join([f"{n_tests} of {n_tests + self._n_left} tests", *failures])

    def _state(self, age: float) -> tuple[str, bool]:
        """Return a sentence on the run, and whether it is at work, as far as is known.

        Args:
            age: Seconds since the study has changed.
        """
        action = ""  # what the run has done last at a request since it began
        for request in self._facts.steering:
            if request["answer"] == "done":
                action = request["action"]
        # What Recorded tests is planned by nobody, so that its end is not known.
        is_planned = any("planned" in run.record for run in self._facts.runs[-1:])
        if is_planned and self._n_left == 0:
            return "All planned tests are done.", False
        if action == "stop":
            return "Stopped. The command of the run continues it.", False
        if not _is_alive(*self._facts.process):
            return "No run is at work. The command of the last one continues it.", False
        if action == "pause":
            return "Paused.", True
        return f"The study last changed {age:.0f} s ago.", True

    async def events(self, edition: str, position: int) -> AsyncIterator[str]:
        """Yield what is new for a page, as events, until it has to be loaded anew.

        Args:
            edition: The edition of the page.
            position: How many tests it has.
        """
        # Nothing is queued for a reader who is slow: the next event has all that came meanwhile.
        progress = None
        while edition == self.edition and position <= len(self.tests):
            if progress is not self.progress:
                progress = self.progress
                tests = self.tests
                rows = []
                is_new = ~tests.repeats  # the page has each design once
                is_new[:position] = False
                new = designs_of_page(tests.take(is_new))
                if len(new):
                    rows.append(rows_of(new))
                position = len(tests)
                content = json.dumps({"rows": rows} | progress, allow_nan=False)
                yield f"id: {edition}-{position}\ndata: {content}\n\n"
            await asyncio.sleep(_PAUSE / 2)
        yield "data: {}\n\n"

    def steer(self, content: bytes) -> None:
        """Write a request into the study, whose run checks the names in a formulation.

        Raises:
            PsiError: It is no request, or the study cannot be written.
        """
        if not self._steer:
            raise PsiError("the page is read-only (--steer)")
        try:
            received = json.loads(content)
            json.dumps(received, ensure_ascii=False).encode()  # half a surrogate pair is no text
            action, name = received["action"], str(received["name"])
        except (ValueError, TypeError, LookupError, RecursionError):
            raise PsiError("a request must be JSON with an action and a name") from None
        known_name("action", action, ACTIONS)
        if action not in LASTING and not _is_alive(*self._facts.process):
            raise PsiError("no run is at work; its command continues it")
        details: Values = {}
        if action == "more":
            details["count"] = further_tests(received.get("count"))
        if action == "search":
            details["formulation"] = received.get("formulation")
            Decision.from_json(json.dumps(details["formulation"]).encode(), "formulation")
        name = "".join(filter(str.isprintable, name)).strip()[:60]
        if not name:
            raise PsiError("give your name, for the record")
        with self.study.changes() as database:
            database.steer({"name": name, "action": action, **details})


def _is_alive(host: str, process: int) -> bool:
    """Whether a process is there; one of another machine is assumed to be."""
    if host != node() or sys.platform == "win32":
        return True
    try:
        os.kill(process, 0)
    except OSError as error:
        return isinstance(error, PermissionError)
    return True


def _application(growing: GrowingStudy, token: str) -> ASGIApp:
    """Return the application, whose addresses begin with the token."""
    from starlette.applications import Starlette
    from starlette.concurrency import run_in_threadpool
    from starlette.exceptions import HTTPException
    from starlette.middleware import Middleware
    from starlette.middleware.trustedhost import TrustedHostMiddleware
    from starlette.responses import HTMLResponse, PlainTextResponse, Response, StreamingResponse
    from starlette.routing import Mount, Route

    def page(_: Request) -> Response:
        text = growing.page()
        if not text:
            lines = "<br>".join(map(escape, growing.progress["lines"]))
            text = f"<meta http-equiv=refresh content=1>There is no feasible design yet.<br>{lines}"
        return HTMLResponse(text)

    async def events(request: Request) -> Response:
        place = request.headers.get("last-event-id") or request.query_params.get("from", "")
        edition, _, position = place.partition("-")
        if not position.isdecimal() or _is_foreign(request):
            raise HTTPException(403, "No position, or of another origin.")
        content = growing.events(edition, int(position))
        return StreamingResponse(content, media_type="text/event-stream")

    async def steering(request: Request) -> Response:
        length = request.headers.get("content-length", "")
        if _is_foreign(request):
            raise HTTPException(403, "The request is of another origin.")
        if not length.isdecimal() or int(length) > _LONGEST:
            raise HTTPException(413, "The request is too long.")
        await run_in_threadpool(growing.steer, await request.body())
        return Response()

    def refused(_: Request, error: Exception) -> Response:
        return PlainTextResponse(str(error), 400)

    routes = [
        Route("/", page),
        Route("/events", events),
        Route("/steer", steering, methods=["POST"]),
    ]
    # A browser may take another site for this one, by a name that leads to this address.
    own_host = Middleware(TrustedHostMiddleware, allowed_hosts=[_HOST, "localhost"])
    return Starlette(
        routes=[Mount(f"/{token}", routes=routes)],
        middleware=[own_host],
        exception_handlers={PsiError: refused},
    )


def _is_foreign(request: Request) -> bool:
    """Whether a request comes from the page of another site; reading needs no origin."""
    origin = request.headers.get("origin")
    is_own = origin == f"http://{request.headers['host']}"
    return not (is_own or (origin is None and request.method == "GET"))


def serve(
    study: FilePath,
    *,
    port: int | None = None,
    steer: bool = False,
    say: Callable[[str], None] = print,
) -> None:
    """Serve the page of a study until interrupted; see :func:`live`.

    Args:
        study: The study, which may not exist yet.
        port: The port; by default 8741 or, if it is taken, any.
        steer: Whether the page can steer the run.
        say: Is called with the address.

    Raises:
        PsiError: The extra is not installed, or the file is no study.
        OSError: The port is taken.
    """
    path = Path(Study(study).path)
    if path.exists():
        Study(path).facts()  # another file is refused here
    token = _token(path)
    growing = GrowingStudy(path, steer=steer)
    try:
        import uvicorn

        application = _application(growing, token)
    except ImportError as error:
        raise PsiError(f"live needs {error.name}: pip install 'pymoo-psi[live]'") from error
    try:
        listening = socket.create_server((_HOST, port if port is not None else _PORT))
    except OSError:
        if port is not None:
            raise
        listening = socket.create_server((_HOST, 0))

    def watch() -> None:
        while True:
            growing.look()
            time.sleep(_PAUSE)

    growing.look()
    threading.Thread(target=watch, daemon=True).start()
    config = uvicorn.Config(
        application,
        log_level="critical",
        lifespan="off",
        headers=[*_HEADERS.items()],
        timeout_graceful_shutdown=1,
    )
    say(f"http://{_HOST}:{listening.getsockname()[1]}/{token}/")
    uvicorn.Server(config).run(sockets=[listening])


def _token(path: Path) -> str:
    """Return the token of a study, which a file beside it keeps for this user alone.

    With it the pages of a server that has ended find the next one.
    """
    file = path.with_name(f"{path.name}-live")
    token = secrets.token_urlsafe(24)
    with suppress(OSError):  # without the file the token changes every time
        if not file.exists():
            with whole_file(file) as new:  # another server never reads a part of it
                new.touch(0o600)
                new.write_text(token)
        if file.stat().st_mode & 0o077 == 0:
            return file.read_text() or token
    return token


class LiveView:
    """A page of a growing study; a notebook shows it. Its server ends with it, or with Python.

    Attributes:
        address: The address of the page.
    """

    def __init__(self, process: subprocess.Popen[str], address: str) -> None:
        self._process = process
        self.address = address

    def __enter__(self) -> LiveView:
        """Return this view."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the server; the study and its run go on."""
        self._process.communicate()

    def _repr_html_(self) -> str:
        """Return the page in a frame, which reaches nothing else in the notebook."""
        return (
            f'<iframe src="{self.address}" '
            'sandbox="allow-scripts allow-same-origin allow-downloads allow-modals" '
            'style="width: 100%; height: 90vh; min-height: 600px; border: 0"></iframe>'
        )


def live(study: FilePath, *, steer: bool = False, port: int | None = None) -> LiveView:
    """Return a page that follows a study as it grows, whatever process adds to it.

    Args:
        study: The file, which may not exist yet.
        steer: Whether the page can steer the run: direct its search, pause, continue, extend or end
            it.
        port: The port of the server on this machine; by default 8741 or, if it is taken, any.

    Raises:
        ArgumentValueError: The name is that of a table.
        PsiError: The extra ``live`` is not installed, or the server cannot start.

    Example:
        >>> import tempfile
        >>> from pymoo_psi import live
        >>> with tempfile.TemporaryDirectory() as folder, live(f"{folder}/bnh.db") as view:
        ...     print(view.address)
        http://127.0.0.1:.../
    """
    words = [sys.executable, "-m", "pymoo_psi", "live", Study(study).path]
    words += ["--no-browser", "--attached"]
    if steer:
        words.append("--steer")
    if port is not None:
        words.append(f"--port={port}")
    pipe = subprocess.PIPE
    with TemporaryFile("w+") as messages:  # a pipe that nobody reads would block the server
        process = subprocess.Popen(words, stdin=pipe, stdout=pipe, stderr=messages, text=True)
        address = process.stdout.readline().strip() if process.stdout else ""
        if not address:
            process.communicate()
            messages.seek(0)
            reason = messages.read().strip().removeprefix("pymoo-psi: error: ")
            raise PsiError(f"the server of {study} cannot start: {reason}")
    return LiveView(process, address)
