"""The height of a Tello, from the better of the two words that tell it. Pure."""

from typing import NamedTuple

from drivers.tello.wire.text import State

# WIRE (docs/reference/tello.md 3): `tof` 6553 is no echo; no sensor of this size measures as far as this.
_FARTHEST_CM = 1000
_TOF_STD_M = 0.05
# WIRE (docs/reference/tello.md 3): `h` comes in steps of 10 cm, and is 0 to 35 cm lower than `tof`.
_H_LOW_M, _H_STD_M = 0.175, 0.10
_OFF_FLOOR_M, _RISEN_M = 0.1, 0.4


class Height(NamedTuple):
    """Height [m] with its standard deviation [m]: above the floor by `tof`, else above the take-off by `h`."""

    m: float
    std_m: float

    @property
    def off_floor(self) -> bool:
        """Return whether a standing vehicle cannot report this height."""
        return self.m - 2.0 * self.std_m >= _OFF_FLOOR_M - 1e-9

    @property
    def risen(self) -> bool:
        """Return whether the height of a take-off is about reached."""
        return self.off_floor and self.m >= _RISEN_M


def best_height(state: State) -> Height:
    """Return the height by `tof` if it has an echo, else by `h`, raised by the mean of its error."""
    if 0 < state.tof <= _FARTHEST_CM:
        return Height(state.tof / 100, _TOF_STD_M)
    return Height(state.height / 100 + _H_LOW_M, _H_STD_M)
