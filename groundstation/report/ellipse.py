"""95 % ellipses of planar covariances."""

import math

import numpy as np

from groundstation.report.tracks import Array

CHI2_95_2D = -2.0 * math.log(0.05)


def semi_axes_95(covariance: Array) -> tuple[float, float, float]:
    """Return major and minor semi-axis [m] and direction of the major one [rad] of a (2, 2) covariance."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    major, minor = (math.sqrt(max(0.0, float(value)) * CHI2_95_2D) for value in values[::-1])
    return major, minor, math.atan2(float(vectors[1, 1]), float(vectors[0, 1]))
