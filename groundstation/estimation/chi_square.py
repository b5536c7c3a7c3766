"""Chi-square gates, without scipy (its import would cost the tracker most of a second)."""

import math


def _chi_square_cdf(x: float, degrees: int) -> float:
    """Return the distribution function for 1 to 4 degrees of freedom, in closed form."""
    half = 0.5 * x
    match degrees:
        case 1:
            return math.erf(math.sqrt(half))
        case 2:
            return -math.expm1(-half)
        case 3:
            return math.erf(math.sqrt(half)) - math.sqrt(2.0 * x / math.pi) * math.exp(-half)
        case 4:
            return 1.0 - math.exp(-half) * (1.0 + half)
        case _:
            raise ValueError(f"degrees must be 1 to 4 (got {degrees})")


def gate(probability: float, degrees: int) -> float:
    """Return the NIS below which a consistent measurement stays with the given probability, by bisection."""
    if not 0.0 < probability < 1.0:
        raise ValueError(f"probability must be between 0 and 1 (got {probability})")
    low, high = 0.0, 400.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        if _chi_square_cdf(middle, degrees) < probability:
            low = middle
        else:
            high = middle
    return high
