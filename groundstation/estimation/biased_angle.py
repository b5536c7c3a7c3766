"""Covariance of an angle that is integrated from a gyroscope, and of that gyroscope's bias."""

import math

_UNKNOWN_BIAS = math.radians(0.5)  # before anything is learnt [rad/s]
# Warming up by 10 degrees in 10 minutes, such a gyroscope drifts by 0.3 degrees per second [rad/s per root second].
_BIAS_DRIFT = 2e-4


class BiasedAngle:
    """Covariance of the errors of an angle and of a bias that it is integrated with: a Kalman filter of two entries.

    variance: of the angle [rad^2]; bias_variance: of the bias [rad^2/s^2].
    """

    def __init__(self, variance: float) -> None:
        self.variance, self.bias_variance = variance, _UNKNOWN_BIAS**2
        self._shared = 0.0

    def begin(self, variance: float) -> None:
        """Begin the angle anew; the bias is as well known as before."""
        self.variance, self._shared = variance, 0.0

    def go_on(self, elapsed_s: float, density: float) -> None:
        """Integrate over a time; density: of the gyroscope's noise [rad^2/s]."""
        self.variance += elapsed_s * (density - 2.0 * self._shared + elapsed_s * self.bias_variance)
        self._shared -= elapsed_s * self.bias_variance
        self.bias_variance += elapsed_s * _BIAS_DRIFT**2

    def see_angle(self, variance: float) -> tuple[float, float]:
        """Return the gains by which the innovation of a measured angle corrects the angle, and the bias [1/s]."""
        total = self.variance + variance
        angle, bias = self.variance / total, self._shared / total
        self.bias_variance -= bias * self._shared
        self._shared -= angle * self._shared
        self.variance -= angle * self.variance
        return angle, bias

    def see_bias(self, variance: float) -> tuple[float, float]:
        """Return the gains by which the innovation of a measured bias corrects the angle [s], and the bias."""
        total = self.bias_variance + variance
        angle, bias = self._shared / total, self.bias_variance / total
        self.variance -= angle * self._shared
        self._shared -= bias * self._shared
        self.bias_variance -= bias * self.bias_variance
        return angle, bias
