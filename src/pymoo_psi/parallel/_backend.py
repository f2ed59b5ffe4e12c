"""Which workers joblib's configuration asks for: ours, threads, or those of a cluster."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

# joblib is imported in the functions that need it: a worker, which imports this, does not.


@dataclass(frozen=True)
class Workers:
    """What joblib would use now.

    Attributes:
        count: How many evaluations run at the same time.
        kind: ``"processes"`` of our own, joblib's ``"loky"`` processes where that is configured,
            ``"threads"`` of this process, or a ``"cluster"``.
        return_as: How joblib can return the results.
    """

    count: int
    kind: str
    return_as: str


def active_workers(n_jobs: int) -> Workers:
    """Return the workers for ``n_jobs`` jobs; -1 leaves the number to ``parallel_config``."""
    from joblib.parallel import get_active_backend

    backend, configured = get_active_backend()
    if n_jobs == -1 and configured is not None:
        n_jobs = configured
    kind = "cluster"
    if type(backend).__module__ == "joblib._parallel_backends":
        # What is configured is always the same object; joblib's default is a new one each time.
        kind = "processes"
        if type(backend).__name__ == "ThreadingBackend":
            kind = "threads"
        elif type(backend).__name__ == "LokyBackend" and get_active_backend()[0] is backend:
            kind = "loky"
        n_jobs = _cores() if n_jobs == -1 else n_jobs
    return Workers(
        count=max(1, backend.effective_n_jobs(n_jobs)),
        kind=kind,
        return_as="generator_unordered" if backend.supports_return_generator else "list",
    )


@cache
def _cores() -> int:
    """Return the number of cores; joblib reads it from files, which takes longer than a batch."""
    from joblib import cpu_count

    return int(cpu_count())
