"""A worker process, seen from inside: it evaluates what it is sent until its parent is gone.

Messages in: ``("function", pickled)`` and ``("designs", [(index, design), ...])``. Messages out:
``("unusable", text)`` for a function that cannot be loaded; ``("begun",)`` before a first design;
for each design, as soon as it is done, ``("done", index, values, seconds)``,
``("raised", index, EvaluationError)`` or, if its values cannot be sent, ``("lost", index, why)``.
"""

from __future__ import annotations

import os
import queue
import signal
import sys
import threading
import time
from multiprocessing import connection
from typing import Any

import cloudpickle

from pymoo_psi.errors import EvaluationError
from pymoo_psi.parallel._outcome import Function, evaluate_to_travel, one_line


def main(handle: int) -> None:
    """Serve the other end of an inherited pipe until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what an interrupt means
    if sys.platform == "win32":
        pipe: Any = connection.PipeConnection(handle)
    else:
        os.set_inheritable(handle, False)  # a solver started by the model must not hold it open
        pipe = connection.Connection(handle)
    _serve(pipe)


def _serve(pipe: Any) -> None:
    inbox: queue.SimpleQueue[Any] = queue.SimpleQueue()
    busy = threading.Event()
    threading.Thread(target=_receive, args=(pipe, inbox, busy), daemon=True).start()
    function: Function | None = None
    while True:
        message = inbox.get()
        if message is None:
            return
        kind, content = message
        busy.set()
        if kind == "function":
            function = None
            try:
                function = cloudpickle.loads(content)
            except Exception as error:
                _send(pipe, ("unusable", one_line(error)))
        elif function is not None:
            _send(pipe, ("begun",))
            for index, design in content:
                _send(pipe, _outcome(function, index, design))
        busy.clear()


def _receive(pipe: Any, inbox: queue.SimpleQueue[Any], busy: threading.Event) -> None:
    """Pass messages on; when the parent is gone, end at once even amid an evaluation."""
    try:
        while True:
            inbox.put(cloudpickle.loads(pipe.recv_bytes()))
    except (EOFError, OSError):
        if busy.is_set():
            end_group(os.getpid())
            os._exit(1)
        inbox.put(None)


def end_group(pid: int) -> None:
    """Kill a worker and the processes that its model has started."""
    if sys.platform == "win32":
        os.kill(pid, signal.SIGTERM)
    else:
        os.killpg(pid, signal.SIGKILL)  # a worker leads a group of its own


def _outcome(function: Function, index: int, design: Any) -> tuple[Any, ...]:
    start = time.perf_counter()
    try:
        values = evaluate_to_travel(function, design)
    except EvaluationError as error:
        return ("raised", index, error)
    return ("done", index, values, time.perf_counter() - start)


def _send(pipe: Any, message: tuple[Any, ...]) -> None:
    try:
        data = cloudpickle.dumps(message)
    except Exception as error:  # the values of the model do not travel
        reason = f"its values cannot be sent by its worker process: {one_line(error)}"
        data = cloudpickle.dumps(("lost", message[1], reason))
    try:
        pipe.send_bytes(data)
    except OSError:  # the parent is gone
        os._exit(1)
