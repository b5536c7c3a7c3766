"""Damaged datagrams of motion capture, ranging and Tellos, and the decoders that read them."""

from damage import Random, damaged_bytes

from drivers.motion_capture.wire import natnet
from drivers.ranging.wire.ranges import Round, encode
from drivers.tello.wire.text import State
from sim_bridge.devices.tello_text import state_text

RANGES = encode(Round("tag_1", {"north": 3.25, "south": 4.5, "east": 0.75}, 4.0, 1.5e6))
TELLO = state_text(State(1, -2, 30, (1, 2, -3), 80, 75, 87, 12, (1.0, -2.0, -998.0)))

_VERSIONS = ((3, 0), (4, 0), (4, 1))
_FRAME = natnet.Frame(7, tuple(natnet.Body(i, (0.1, 0.2, 0.3), (0.0, 0.0, 0.0, 1.0), i != 2) for i in (1, 2, 3)), 9, 10)
_SERVER = natnet.encode_server(natnet.Server("Motive", (4, 1), 1_000_000, 1511, "239.255.42.99"))
NATNET = [
    *((natnet.encode_frame(_FRAME, version), version) for version in _VERSIONS),
    *((natnet.encode_descriptions({1: "drone_1", 2: "cart"}, version), version) for version in _VERSIONS),
    (_SERVER, (4, 1)),
]


def damaged_natnet(rng: Random) -> tuple[bytes, natnet.Version]:
    """Return a datagram and the version to read it in; half of them have a corrected size."""
    good, version = rng.choice(NATNET)
    data = damaged_bytes(rng, good, b"\x01\x05\x07")
    if rng.random() < 0.5 and len(data) >= 4:
        data[2:4] = (len(data) - 4).to_bytes(2, "little")
    return bytes(data), version


def read_natnet(damaged: tuple[bytes, natnet.Version]) -> None:
    """Read a datagram by its own type."""
    kind, payload = natnet.message_of(damaged[0])
    match kind:
        case natnet.FRAME:
            natnet.decode_frame(payload, damaged[1])
        case natnet.DESCRIPTIONS:
            natnet.decode_descriptions(payload, damaged[1])
        case natnet.SERVER_INFO:
            natnet.decode_server(payload)
