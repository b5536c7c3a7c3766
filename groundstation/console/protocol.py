"""The messages from pages: small tagged JSON, checked before use."""

from typing import Annotated

import msgspec

from groundstation.bus.messages import Verb
from groundstation.errors import MessageError

MAX_BYTES = 4096
Name = Annotated[str, msgspec.Meta(max_length=48)]
Names = Annotated[tuple[Name, ...], msgspec.Meta(max_length=64)]
Metres = Annotated[float, msgspec.Meta(ge=-100, le=100)]
PageTime = Annotated[float, msgspec.Meta(ge=0, le=1e13)]
"""The page's own clock [ms], which the server only repeats."""


class FromPage(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag=str.lower):
    """Base of messages from pages."""


class Hello(FromPage, frozen=True):
    """First message: the token that the page was served with, and an id that survives a reconnection.

    sent_ms: when it was sent, as in all that the server answers with its own time.
    """

    token: Annotated[str, msgspec.Meta(max_length=64)]
    client: Annotated[str, msgspec.Meta(min_length=4, max_length=40, pattern="^[A-Za-z0-9-]+$")]
    sent_ms: PageTime | None = None


class CommandRequest(FromPage, frozen=True, tag="order"):
    """A command to the drones named (none: all), given for the run that the page then showed.

    at_ms: the server's time when it was given, at the earliest; unsure_ms: by how much later that may have been, which
    is what a round trip leaves open; age_ms: how long the page has kept it; ref: the page's own id; anyway: of TAKEOFF,
    although the checks before it forbid it.
    """

    verb: Verb
    drones: Names
    run: Annotated[str, msgspec.Meta(max_length=40)]
    at_ms: float
    age_ms: Annotated[float, msgspec.Meta(ge=0)]
    ref: Annotated[str, msgspec.Meta(max_length=40)] = ""
    anyway: bool = False
    unsure_ms: Annotated[float, msgspec.Meta(ge=0)] = 0.0


class TakeOver(FromPage, frozen=True):
    """The viewer becomes the operator."""


class Release(FromPage, frozen=True):
    """The viewer is no longer the operator."""


class FramesHandled(FromPage, frozen=True, tag="seen"):
    """Frames up to this number have been handled."""

    seq: int
    sent_ms: PageTime | None = None


class EndKept(FromPage, frozen=True, tag="kept"):
    """The page holds all data that it shows of an ended run."""


class Watch(FromPage, frozen=True):
    """The cameras whose pictures are wanted."""

    cameras: Names


class Drive(FromPage, frozen=True):
    """Steers a simulated target; the first, if none is named."""

    speed_m_s: Annotated[float, msgspec.Meta(ge=-2, le=2)]
    turn_rad_s: Annotated[float, msgspec.Meta(ge=-4, le=4)]
    target: Name = ""


class Place(FromPage, frozen=True):
    """Puts a simulated target somewhere [world]."""

    x_m: Metres
    y_m: Metres
    target: Name = ""


class FollowPath(FromPage, frozen=True):
    """Sends a simulated target back to its path."""

    target: Name = ""


class Play(FromPage, frozen=True):
    """Plays or pauses a replay."""

    playing: bool


class Speed(FromPage, frozen=True):
    """Speed of a replay relative to real time."""

    factor: Annotated[float, msgspec.Meta(ge=0.1, le=20)]


class Seek(FromPage, frozen=True):
    """Takes a replay to a time of the run's boot clock."""

    at_ms: Annotated[float, msgspec.Meta(ge=0, le=1e13)]


class StepReplay(FromPage, frozen=True, tag="step"):
    """Moves a replay by a number of the tracker's ticks, backwards if negative, and pauses it there."""

    ticks: Annotated[int, msgspec.Meta(ge=-50, le=50)]


Playing = Play | Speed | Seek | StepReplay
Steering = Drive | Place | FollowPath
PageMessage = Hello | CommandRequest | TakeOver | Release | FramesHandled | EndKept | Watch | Steering | Playing
_decoder: msgspec.json.Decoder[PageMessage] = msgspec.json.Decoder(PageMessage)


def decode(text: str | bytes) -> PageMessage:
    """Return a page's message; raises MessageError (too_long, malformed)."""
    if len(text) > MAX_BYTES:
        raise MessageError("too_long", f"{len(text)} bytes")
    try:
        return _decoder.decode(text)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise MessageError("malformed", str(error)) from error
