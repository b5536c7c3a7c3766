"""How every compiled function of the pure core is declared: explicit signature, cached, without the GIL.

An explicit signature compiles when the module is imported, so nothing can compile later in flight. Models are called
through tables of addresses: the loops that call them are compiled once and need no edit when a model is added.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(signature: str, inlined: bool = False) -> Callable[[Function], Function]:
    """Compile a function for one signature; IEEE arithmetic (no fastmath), so that replays agree to the bit.

    inlined: into every kernel that calls it, for what is short or called from one place. To hand over a dozen arrays
    takes as long as a small kernel's work; but what is copied often makes compiling slow.

    Cached only in a directory that the process has chosen by the state of all sources (process/numba_cache.py): beside
    the source, numba would not notice an edited callee or constant of another module.
    """
    cached = bool(getattr(numba.config, "CACHE_DIR", ""))
    compiled = numba.njit(signature, cache=cached, nogil=True, error_model="numpy", fastmath=False, forceinline=inlined)
    return cast(Callable[[Function], Function], compiled)


def address_of(compiled: Callable[..., Any]) -> int:
    """Return where the machine code of a kernel starts, as a C function; valid in this process only."""
    (result,) = cast(Any, compiled).overloads.values()
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name))


def caller(signature: str) -> Callable[..., Any]:
    """Return a function for use inside kernels: called with an address and arguments, it calls the kernel there.

    The address is data, not part of the compiled code, so that what calls it can be cached.
    """
    expected = numba.core.sigutils.normalize_signature(signature)
    arguments, result = expected

    @intrinsic
    def call_at(_typing: Any, address: Any, given: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            unpacked = [builder.extract_value(values[1], i) for i in range(len(arguments))]
            shape = ir.FunctionType(context.get_value_type(result), [context.get_value_type(a) for a in arguments])
            value = builder.call(builder.inttoptr(values[0], shape.as_pointer()), unpacked)
            return context.get_dummy_value() if result == types.void else value

        return result(types.int64, types.Tuple(arguments)), generate

    return cast(Callable[..., Any], call_at)
