"""The emulated Tello's side of the text protocol: states out, sticks in."""

from drivers.tello.wire.text import State

STOP, STREAM_OFF = b"stop", b"streamoff"


def state_text(state: State) -> bytes:
    """Return a state as the vehicle sends it."""
    vx, vy, vz = state.velocity
    ax, ay, az = state.acceleration
    return (
        f"pitch:{state.pitch};roll:{state.roll};yaw:{state.yaw};vgx:{vx};vgy:{vy};vgz:{vz};templ:60;temph:62;"
        f"tof:{state.tof};h:{state.height};bat:{state.battery};baro:0.00;time:{state.time};"
        f"agx:{ax:.2f};agy:{ay:.2f};agz:{az:.2f};\r\n"
    ).encode("ascii")


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
