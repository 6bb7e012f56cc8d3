"""What a batch has found for a case, handed to the run of that case, which leaves its files as if it had been alone."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from belt_sim.curves import Curves
from belt_sim.errors import RunFailed

_FOUND: ContextVar[Curves | RunFailed | None] = ContextVar("found", default=None)


@contextmanager
def handing(found: Curves | RunFailed | None) -> Iterator[None]:
    """Within it the one march that is asked for has been made already; None: it has not."""
    token = _FOUND.set(found)
    try:
        yield
    finally:
        _FOUND.reset(token)


def handed() -> Curves | RunFailed | None:
    """What has been found for the case that runs now."""
    return _FOUND.get()
