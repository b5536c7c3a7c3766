"""Lets a standing AR.Drone blink, to show which one it is."""

from drivers.ardrone.conversation import with_standing
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.ardrone.wire import at
from groundstation.adapters import with_zone

# WIRE (docs/reference/ardrone.md 2.4): animation 3, orange; there is no acknowledgement, and datagrams get lost.
_ORANGE, _HZ, _LASTS_S, _TIMES = 3, 4.0, 4, 3


def blink(section: str, _name: str) -> str:
    """Let a drone's lights blink for 4 s; returns a description of them. section: the driver's, as JSON.

    Raises DriverError when it does not answer, or its motors may turn.
    """
    settings = ArDroneDriverSettings.model_validate_json(section)
    with with_standing(with_zone(settings.address, settings.interface)) as line:
        for _ in range(_TIMES):
            line.say(at.led(_ORANGE, _HZ, _LASTS_S))
            line.listen(0.05)
        line.listen(_LASTS_S)
    return "its lights blinked orange"
