"""Libraries of numbers held to one thread: many processes share few cores, and thread pools would only compete."""

import os
from collections.abc import Mapping

_POOLS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def one_thread() -> Mapping[str, str]:
    """Return our environment for a child process whose libraries use one thread each."""
    return os.environ | dict.fromkeys(_POOLS, "1")


def stay_on_one_thread() -> None:
    """Hold the libraries that this process has not loaded yet to one thread, unless its environment says otherwise."""
    for name in _POOLS:
        os.environ.setdefault(name, "1")
