"""Commands and state of the Tello as text.

WIRE (docs/reference/tello.md 2, 3): commands are ASCII words, answered by `ok` or `error ...`; the state is a line of
`key:value;` pairs.
"""

from dataclasses import dataclass

COMMAND_PORT = 8889
STATE_PORT = 8890
VIDEO_PORT = 11111
SDK, TAKE_OFF, LAND, EMERGENCY, STOP = b"command", b"takeoff", b"land", b"emergency", b"stop"
STREAM_ON, STREAM_OFF = b"streamon", b"streamoff"
OK = b"ok"
_LARGEST = 1024


class WireError(ValueError):
    """Text that is no state; `reason` is a word to count it by."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


@dataclass(frozen=True, slots=True)
class State:
    """What the vehicle reports, in its own units.

    pitch, roll, yaw: degrees, yaw clockwise; velocity: dm/s along north-east-down axes in which yaw is 0; tof: distance
    to the floor [cm]; height: above the take-off [cm]; battery [%]; time: of the motors [s]; acceleration [mg].
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
        pairs = dict(pair.split(":", 1) for pair in data.decode("ascii").strip().strip(";").split(";"))
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


def state_text(state: State) -> bytes:
    """Return a state as the vehicle sends it."""
    vx, vy, vz = state.velocity
    ax, ay, az = state.acceleration
    return (
        f"pitch:{state.pitch};roll:{state.roll};yaw:{state.yaw};vgx:{vx};vgy:{vy};vgz:{vz};templ:60;temph:62;"
        f"tof:{state.tof};h:{state.height};bat:{state.battery};baro:0.00;time:{state.time};"
        f"agx:{ax:.2f};agy:{ay:.2f};agz:{az:.2f};\r\n"
    ).encode("ascii")


def rc(right: int, forward: int, up: int, clockwise: int) -> bytes:
    """Return stick positions, each cut to -100..100."""
    sticks = (max(-100, min(100, value)) for value in (right, forward, up, clockwise))
    return b"rc " + b" ".join(b"%d" % value for value in sticks)


def parse_rc(data: bytes) -> tuple[int, int, int, int] | None:
    """Return the stick positions of a command, None for another one."""
    words = data.split()
    if len(words) != 5 or words[0] != b"rc":
        return None
    try:
        a, b, c, d = (int(word) for word in words[1:])
    except ValueError:
        return None
    return (a, b, c, d) if max(abs(a), abs(b), abs(c), abs(d)) <= 100 else None
