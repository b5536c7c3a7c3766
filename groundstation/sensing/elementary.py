"""Exponential and logarithm without branches or calls, so that loops over many points are vectorised."""

from groundstation.kernel import kernel

_LEAST = -40.0
_LOG_MIDDLE = 0.8958797346140275  # of the square root of 6


@kernel(inlined=True, contract=True)
def decay(exponent: float) -> float:
    """Return exp(exponent) for an exponent of at most 0, to 1e-12 of it from -20 on; 0 below -40."""
    y = (exponent if exponent > _LEAST else _LEAST) / 128.0
    series = 1 / 24 + y * (1 / 120 + y * (1 / 720 + y * (1 / 5040 + y * (1 / 40320))))
    y = 1.0 + y * (1.0 + y * (1 / 2 + y * (1 / 6 + y * series)))
    y *= y
    y *= y
    y *= y
    y *= y
    y *= y
    y *= y
    y *= y
    return y if exponent > _LEAST else 0.0


@kernel(inlined=True, contract=True)
def log_of_sum(total: float) -> float:
    """Return log(total) of a sum of up to six shares, the largest of them 1: for 1 to 6, to 1e-10."""
    ratio = total * 0.4082482904638631
    s = (ratio - 1.0) / (ratio + 1.0)
    q = s * s
    series = 1 / 11 + q * (1 / 13 + q * (1 / 15 + q * (1 / 17 + q * (1 / 19 + q * (1 / 21 + q * (1 / 23))))))
    series = 1.0 + q * (1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q * series))))
    return _LOG_MIDDLE + 2.0 * s * series
