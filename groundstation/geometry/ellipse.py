"""95 % ellipses of planar covariances."""

import math

_CHI2_95_2D = -2.0 * math.log(0.05)


def semi_axes_95(xx: float, xy: float, yy: float) -> tuple[float, float, float]:
    """Return major and minor semi-axis [m] and direction of the major one [rad] of a covariance [m^2]."""
    middle, spread = (xx + yy) / 2, math.hypot((xx - yy) / 2, xy)
    major, minor = (math.sqrt(max(0.0, value) * _CHI2_95_2D) for value in (middle + spread, middle - spread))
    return major, minor, 0.5 * math.atan2(2 * xy, xx - yy)
