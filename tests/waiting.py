"""Waiting for what processes, threads and browsers do: for a condition, never for a time.

A computer may be busy with others, so the limit is for what never comes.
"""

import time
from collections.abc import Callable

PATIENCE = 240.0  # s; a machine's code may have to be compiled meanwhile
_PAUSE = 0.01  # s


def wait_for(condition: Callable[[], object], pause: Callable[[], object] = lambda: time.sleep(_PAUSE)) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "did not come in time"
        pause()
