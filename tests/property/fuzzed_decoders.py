"""Table of the decoders of external data: damaged inputs for each, and the errors that it declares."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from damage import Random, damaged_bytes, damaged_json
from fuzzed_documents import damaged_field, damaged_sample, damaged_words, read_field, read_sample
from fuzzed_sensors import RANGES, TELLO, damaged_natnet, read_natnet
from fuzzed_wire import (
    COMMANDS,
    damaged_frame,
    damaged_navdata,
    damaged_old_frame,
    damaged_ros2,
    damaged_stream,
    read_commands,
    read_frames,
    read_navdata,
    read_ros2,
    read_stream,
)

from drivers.ardrone.wire import errors as ardrone_errors
from drivers.mavlink.wire import errors as mavlink_errors
from drivers.motion_capture.wire.natnet import WireError as NatNetError
from drivers.ranging.wire import ranges
from drivers.rmw_zenoh.wire.cdr import WireError as CdrError
from drivers.tello.wire import text as tello
from groundstation.console import protocol
from groundstation.errors import MessageError, SettingsError


@dataclass(frozen=True, slots=True)
class Decoder:
    """make: returns a damaged input. read: decodes it and uses the result. declared: all errors that it may raise."""

    name: str
    make: Callable[[Random], Any]
    read: Callable[[Any], object]
    declared: type[Exception]


def fuzz(decoder: Decoder, count: int, seed: int) -> Counter[str]:
    """Feed damaged inputs; returns the numbers read and refused, by reason. Any other error is raised."""
    rng, outcomes = Random(seed), Counter[str]()
    for _ in range(count):
        damaged = decoder.make(rng)
        try:
            decoder.read(damaged)
            outcomes["read"] += 1
        except decoder.declared as error:
            outcomes[getattr(error, "reason", "refused")] += 1
        except Exception as error:
            error.add_note(f"{decoder.name}: {damaged!r}")
            raise
    return outcomes


def _all() -> Iterable[Decoder]:
    yield Decoder("navdata", damaged_navdata, read_navdata, ardrone_errors.WireError)
    yield Decoder(
        "at", lambda rng: damaged_bytes(rng, COMMANDS, b'\r\n,=*09"-'), read_commands, ardrone_errors.WireError
    )
    yield Decoder("pave", damaged_stream, read_stream, ardrone_errors.WireError)
    yield Decoder("mavlink_1", damaged_old_frame, read_frames, mavlink_errors.WireError)
    yield Decoder("mavlink_2", damaged_frame, read_frames, mavlink_errors.WireError)
    yield Decoder("ros2", damaged_ros2, read_ros2, CdrError)
    yield Decoder("natnet", damaged_natnet, read_natnet, NatNetError)
    yield Decoder("ranges", lambda rng: damaged_json(rng, RANGES), ranges.decode, ranges.WireError)
    yield Decoder("tello", lambda rng: bytes(damaged_bytes(rng, TELLO, b":;-.")), tello.parse_state, tello.WireError)
    yield Decoder("bus", damaged_sample, read_sample, MessageError)
    yield Decoder("console", damaged_words, protocol.decode, MessageError)
    yield Decoder("field", damaged_field, read_field, SettingsError)


DECODERS = {decoder.name: decoder for decoder in _all()}
