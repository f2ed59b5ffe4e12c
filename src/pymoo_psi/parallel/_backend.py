"""joblib's workers: which ones would be used now, and how they are started ahead of their work."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from functools import cache
from time import sleep
from typing import Any

from joblib import Parallel, cpu_count, delayed
from joblib.parallel import get_active_backend

from pymoo_psi.parallel._outcome import Function


@dataclass(frozen=True)
class Workers:
    """What joblib would use now.

    Attributes:
        count: How many evaluations run at the same time.
        local: Whether they run on this machine, by one of joblib's own backends.
        slow_to_start: Whether they are processes that start once and then wait.
        return_as: How joblib can return the results.
        backend: joblib's backend.
    """

    count: int
    local: bool
    slow_to_start: bool
    return_as: str
    backend: Any


def active_workers(n_jobs: int) -> Workers:
    """Return the workers for ``n_jobs`` jobs; -1 leaves the number to ``parallel_config``."""
    backend, configured = get_active_backend()
    if n_jobs == -1 and configured is not None:
        n_jobs = configured
    own = type(backend).__module__ == "joblib._parallel_backends"
    if own and n_jobs == -1:
        n_jobs = _cores()
    return Workers(
        count=max(1, backend.effective_n_jobs(n_jobs)),
        local=own,
        slow_to_start=own and type(backend).__name__ == "LokyBackend",
        return_as="generator_unordered" if backend.supports_return_generator else "list",
        backend=backend,
    )


@cache
def _cores() -> int:
    """Return the number of cores; joblib reads it from files, which takes longer than a batch."""
    return int(cpu_count())


class WarmUp:
    """Starts joblib's workers, which import the model, while this process goes on evaluating."""

    def __init__(self, f: Function, workers: Workers) -> None:
        self._done = threading.Event()
        threading.Thread(target=self._start, args=(f, workers)).start()

    @property
    def ready(self) -> bool:
        """Whether the workers wait for designs."""
        return self._done.is_set()

    def _start(self, f: Function, workers: Workers) -> None:
        try:
            parallel = Parallel(workers.count, backend=workers.backend, batch_size=1)
            parallel(delayed(_import_model)(f) for _ in range(workers.count))
        except Exception:  # the first chunk will meet the same obstacle, and tell
            pass
        finally:
            self._done.set()


def _import_model(f: Function) -> None:
    """Keep a worker, which has the function now, from taking the place of another."""
    sleep(0.05)
