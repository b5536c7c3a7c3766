"""How every compiled function of the pure core is declared: explicit signature, cached, without the GIL.

An explicit signature compiles when the module is imported, so nothing can compile later in flight.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(signature: str) -> Callable[[Function], Function]:
    """Compile a function for one signature; IEEE arithmetic (no fastmath), so that replays agree to the bit.

    Cached only in a directory that the process has chosen by the state of all sources (process/numba_cache.py): beside
    the source, numba would not notice an edited callee or constant of another module.
    """
    cached = bool(getattr(numba.config, "CACHE_DIR", ""))
    compiled = numba.njit(signature, cache=cached, nogil=True, error_model="numpy", fastmath=False)
    return cast(Callable[[Function], Function], compiled)
