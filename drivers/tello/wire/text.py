"""Commands and state of the Tello as text.

WIRE (docs/reference/tello.md 2, 3): commands are ASCII words, answered by `ok` or `error ...`; the state is a line of
`key:value;` pairs.
"""

from dataclasses import dataclass

COMMAND_PORT = 8889
STATE_PORT = 8890
VIDEO_PORT = 11111
SDK, TAKE_OFF, LAND, EMERGENCY = b"command", b"takeoff", b"land", b"emergency"
STREAM_ON = b"streamon"
CENTRED = b"rc 0 0 0 0"
OK, ERROR = b"ok", b"error"
# WIRE (docs/reference/tello.md 3): `tof` without an echo, as over the floor that it stands on.
NO_ECHO_CM = 6553
_LARGEST = 1024
_MARGIN = "; \t\r\n\0"


class WireError(ValueError):
    """A text that is no valid state; `reason` is a word to count it by."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


@dataclass(frozen=True, slots=True)
class State:
    """The vehicle's report, in its own units.

    pitch, roll, yaw: degrees, yaw clockwise; velocity: dm/s along north-east-down axes in which yaw is 0; tof: distance
    to the floor [cm], or NO_ECHO_CM; height: above the take-off [cm]; battery [%]; time: of the motors [s];
    acceleration [mg].
    """

    pitch: int
    roll: int
    yaw: int
    velocity: tuple[int, int, int]
    tof: int
    height: int
    battery: int
    time: int
    acceleration: tuple[float, float, float]


def parse_state(data: bytes) -> State:
    """Return a state datagram as values; raises WireError: size, not_ascii, no_pairs, missing or out_of_range."""
    if len(data) > _LARGEST:
        raise WireError("size")
    try:
        fields = data.decode("ascii").strip(_MARGIN).split(";")
        # WIRE (docs/reference/tello.md 3): some firmwares put spaces before a key or a value.
        pairs = {key.strip(): value for key, value in (field.split(":", 1) for field in fields)}
    except UnicodeDecodeError:
        raise WireError("not_ascii") from None
    except ValueError:
        raise WireError("no_pairs") from None
    try:
        whole = {
            key: int(pairs[key]) for key in ("pitch", "roll", "yaw", "vgx", "vgy", "vgz", "tof", "h", "bat", "time")
        }
        x, y, z = (float(pairs[key]) for key in ("agx", "agy", "agz"))
    except (KeyError, ValueError):
        raise WireError("missing") from None
    angles = (whole["pitch"], whole["roll"], whole["yaw"])
    if (
        any(abs(angle) > 180 for angle in angles)
        or not 0 <= whole["bat"] <= 100
        or not all(abs(a) < 1e5 for a in (x, y, z))
    ):
        raise WireError("out_of_range")
    velocity = (whole["vgx"], whole["vgy"], whole["vgz"])
    if any(abs(speed) > 1000 for speed in velocity) or not 0 <= whole["tof"] <= 10_000:
        raise WireError("out_of_range")
    return State(*angles, velocity, whole["tof"], whole["h"], whole["bat"], whole["time"], (x, y, z))


def rc(right: int, forward: int, up: int, clockwise: int) -> bytes:
    """Return stick positions, each cut to -100..100."""
    sticks = (max(-100, min(100, value)) for value in (right, forward, up, clockwise))
    return b"rc " + b" ".join(b"%d" % value for value in sticks)
