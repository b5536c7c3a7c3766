"""Waits for events in another thread or process."""

import time
from collections.abc import Callable
from typing import Any


def wait_for(condition: Callable[..., Any], seconds: float = 10.0) -> None:
    """Return once a condition holds; fails on time-out."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "did not happen in time"
        time.sleep(0.005)
