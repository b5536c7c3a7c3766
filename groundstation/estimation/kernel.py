"""How every compiled function of the pure core is declared: explicit signature, cached, without the GIL.

An explicit signature compiles when the module is imported, so nothing can compile later in flight.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(signature: str) -> Callable[[Function], Function]:
    """Compile a function for one signature; IEEE arithmetic (no fastmath), so that replays agree to the bit."""
    return cast(
        Callable[[Function], Function],
        numba.njit(signature, cache=True, nogil=True, error_model="numpy", fastmath=False),
    )
