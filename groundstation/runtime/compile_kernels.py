"""Compiles the kernels that fly, in two processes: `python -m groundstation.runtime.compile_kernels`."""

import importlib
from pathlib import Path

from groundstation.process import numba_cache


def compile_kernels(cache: Path) -> None:
    """Fill the kernel cache, the folder that `numba_cache.activate` returned."""
    # Two halves that take about the same time and share little.
    other_half = numba_cache.ParallelCompilation(["groundstation.planning.planner", "groundstation.estimation.models"])
    for module in (
        "groundstation.estimation.observe",
        "groundstation.estimation.replay",
        "groundstation.sensing.footprint",
    ):
        importlib.import_module(module)
    if other_half.finish():
        numba_cache.mark_complete(cache)


def main() -> None:
    """Compile the kernels that are not in the cache yet, so that the first flight starts at once."""
    cache = numba_cache.activate()
    if not numba_cache.is_complete(cache):
        compile_kernels(cache)


if __name__ == "__main__":
    main()
