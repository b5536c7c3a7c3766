"""Cholesky routines of LAPACK for compiled kernels.

The addresses travel as an integer array, so that the kernels that call them can be cached on disk:
a captured pointer would differ in every process.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import get_cython_function_address, intrinsic

_LOWER = np.frombuffer(b"L", np.uint8).copy()


def lapack_addresses() -> "np.ndarray[Any, np.dtype[np.intp]]":
    """Return the addresses the kernels take: dpotrf, dpotri, dpotrs, and that of the letter L (column-major lower)."""
    module = "scipy.linalg.cython_lapack"
    routines = [get_cython_function_address(module, name) for name in ("dpotrf", "dpotri", "dpotrs")]
    return np.array([*routines, _LOWER.ctypes.data], dtype=np.intp)


def _caller(count: int) -> Any:
    """Return an intrinsic that calls the C function at args[0] with `count` pointer arguments given as integers."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pointer = ir.IntType(8).as_pointer()
        function = ir.FunctionType(ir.VoidType(), [pointer] * count)
        target = builder.inttoptr(args[0], function.as_pointer())
        builder.call(target, [builder.inttoptr(argument, pointer) for argument in args[1:]])
        return context.get_dummy_value()

    return codegen


def _typed_call5(typingctx, f, a, b, c, d, e):  # type: ignore[no-untyped-def]
    return types.void(*[types.intp] * 6), _caller(5)


def _typed_call8(typingctx, f, a, b, c, d, e, g, h, i):  # type: ignore[no-untyped-def]
    return types.void(*[types.intp] * 9), _caller(8)


_call5: Any = intrinsic(_typed_call5)
_call8: Any = intrinsic(_typed_call8)


@njit("b1(f8[:, ::1], i8[::1], i4[::1])", cache=True, nogil=True)
def cholesky(matrix, addresses, integers):  # type: ignore[no-untyped-def]
    """Factor a symmetric matrix in place (upper triangle in C order); False when it is not positive definite."""
    integers[0] = matrix.shape[0]
    n = integers.ctypes.data
    _call5(addresses[0], addresses[3], n, matrix.ctypes.data, n, n + 4)
    return integers[1] == 0


@njit("b1(f8[:, ::1], i8[::1], i4[::1])", cache=True, nogil=True)
def inverse_of_factor(matrix, addresses, integers):  # type: ignore[no-untyped-def]
    """Replace a factor by the inverse of the matrix it factors (upper triangle in C order)."""
    integers[0] = matrix.shape[0]
    n = integers.ctypes.data
    _call5(addresses[1], addresses[3], n, matrix.ctypes.data, n, n + 4)
    return integers[1] == 0


@njit("void(f8[:, ::1], f8[:, ::1], i8, i8[::1], i4[::1])", cache=True, nogil=True)
def solve_with_factor(factor, rows, count, addresses, integers):  # type: ignore[no-untyped-def]
    """Replace the first `count` rows y by A^-1 y, A given by its factor."""
    integers[0] = factor.shape[0]
    integers[2] = count
    n = integers.ctypes.data
    _call8(addresses[2], addresses[3], n, n + 8, factor.ctypes.data, n, rows.ctypes.data, n, n + 4)
