"""A standing AR.Drone shows which one it is: its lights blink."""

from drivers.ardrone.conversation import Conversation
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.ardrone.wire import at
from drivers.ardrone.wire.state import StateBit
from groundstation.errors import DriverError

# WIRE (docs/reference/ardrone.md 2.4): animation 3, orange; nothing acknowledges it, and datagrams get lost.
_ORANGE, _HZ, _LASTS_S, _TIMES = 3, 4.0, 4, 3


def blink(section: str, _name: str) -> str:
    """Let a drone's lights blink for 4 s; returns what to look for. section: the driver's, as JSON.

    Raises DriverError when it does not answer, or its motors may turn: whoever flies it numbers its commands.
    """
    settings = ArDroneDriverSettings.model_validate_json(section)
    address = f"{settings.address}%{settings.interface}" if settings.interface else settings.address
    line = Conversation(address)
    try:
        line.wait_for_answer()
        if line.is_set(StateBit.FLY):
            raise DriverError(f"{settings.address} flies: land it first")
        for _ in range(_TIMES):
            line.say(at.led(_ORANGE, _HZ, _LASTS_S))
            line.listen(0.05)
        line.listen(_LASTS_S)
    except OSError as error:
        raise DriverError(f"{settings.address} cannot be reached: {error.strerror or error}") from error
    finally:
        line.close()
    return "its lights blinked orange"
