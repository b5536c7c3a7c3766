"""Compiles the kernels that fly, in two processes; `python -m groundstation.runtime.kernels` does so beforehand."""

import importlib

from groundstation.process import numba_cache


def compile_kernels() -> None:
    """Fill the kernel cache; `numba_cache.activate` must have chosen it."""
    # Two halves that take about as long and share little.
    other_half = numba_cache.ParallelCompilation(["groundstation.planning.plan", "groundstation.estimation.models"])
    for module in ("groundstation.estimation.events", "groundstation.estimation.replay"):
        importlib.import_module(module)
    other_half.finish()


def main() -> None:
    """Compile what is not in the cache yet, so that the first flight starts at once."""
    # Even where a cache exists: it may be another checkout's, or half filled by a run that was stopped.
    numba_cache.activate()
    compile_kernels()


if __name__ == "__main__":
    main()
