"""The configuration keys that we set on a drone, in the order of writing. Pure."""

import zlib
from dataclasses import dataclass
from typing import NamedTuple

from drivers.ardrone.identity import Identity, Model
from drivers.ardrone.settings import ArDroneDriverSettings, Video
from drivers.ardrone.wire.configuration import CONFIGURATION, format_value

# WIRE (docs/reference/ardrone.md 5.4): values of video:video_codec.
_CODECS = {"h264_360p": 129, "h264_720p": 131}
_CHANNELS = {"front": 0, "bottom": 1}


class Wish(NamedTuple):
    """One key to write; a flight needs confirmation of the required ones."""

    key: str
    value: str
    required: bool = True


class Ids(NamedTuple):
    """Names of our sets of settings: 8 hex digits each."""

    session: str
    user: str
    application: str


@dataclass(frozen=True, slots=True)
class Scale:
    """The configured value of a fraction of 1 in PCMD: tilt [rad], climb [m/s], yaw rate [rad/s]."""

    tilt_rad: float
    climb_m_s: float
    yaw_rate_rad_s: float


def scale_from_settings(settings: ArDroneDriverSettings) -> Scale:
    """Return the limits to configure: those of the settings, clipped to the drone's range."""
    limits = settings.limits
    return Scale(
        _within("control:euler_angle_max", limits.max_tilt_rad),
        _within("control:control_vz_max", limits.max_climb_m_s * 1000) / 1000,
        _within("control:control_yaw", limits.max_yaw_rate_rad_s),
    )


def _within(name: str, value: float) -> float:
    key = CONFIGURATION[name]
    assert key.minimum is not None and key.maximum is not None
    return min(max(value, key.minimum), key.maximum)


def ids_of(name: str) -> Ids:
    """Return our ids. They are the same in every run, so that a drone's flash does not fill with sessions."""
    texts = (f"skein session {name}", "skein", "skein groundstation")
    return Ids(*(f"{zlib.crc32(text.encode()):08x}" for text in texts))


# WIRE (docs/reference/ardrone.md 2.3): a drone that hears no command lands after so many seconds, at least 2.5.
COM_WATCHDOG = Wish("general:com_watchdog", "2")
# WIRE: full navdata; the bootstrap ends with this key, and it belongs to no set of ids.
FULL_NAVDATA = Wish("general:navdata_demo", format_value(False))


def wishes(settings: ArDroneDriverSettings, identity: Identity, with_ids: bool) -> tuple[Wish, ...]:
    """Return the keys to write after `FULL_NAVDATA`.

    WIRE: ids come first, since earlier keys go to another set; `outdoor` copies one of two triples of limits over the
    active ones, so it goes before those.
    """
    scale, flight = scale_from_settings(settings), settings.flight
    ids = ids_of(settings.name)
    names = ("custom:session_id", "custom:profile_id", "custom:application_id")
    return (
        *(Wish(name, value, required=False) for name, value in zip(names, ids, strict=True) if with_ids),
        COM_WATCHDOG,
        Wish("control:outdoor", format_value(flight.outdoor)),
        Wish("control:flight_without_shell", format_value(flight.without_shell)),
        Wish("control:euler_angle_max", f"{scale.tilt_rad:.6g}"),
        Wish("control:control_vz_max", f"{scale.climb_m_s * 1000:.6g}"),
        Wish("control:control_yaw", f"{scale.yaw_rate_rad_s:.6g}"),
        Wish("control:altitude_max", f"{flight.altitude_max_m * 1000:.0f}"),
        Wish("pic:ultrasound_freq", str(flight.ultrasound_freq), required=False),
        *(() if settings.video is None or identity.model is Model.AR1 else _video(settings.video)),
    )


def _video(video: Video) -> tuple[Wish, ...]:
    codec = Wish("video:video_codec", str(_CODECS[video.codec]), required=False)
    channel = Wish("video:video_channel", str(_CHANNELS[video.channel]), required=False)
    if video.bitrate is None:
        return codec, channel
    # WIRE: bitrate control mode 0 is constant, at max_bitrate.
    constant = Wish("video:bitrate_ctrl_mode", "0", required=False)
    return codec, channel, constant, Wish("video:max_bitrate", str(video.bitrate), required=False)
