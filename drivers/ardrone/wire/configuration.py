"""Configuration keys of the drone: type, category, default, range, and their text form.

WIRE: keys and defaults of the SDK 2.0.1 and of dumps of real drones (docs/reference/ardrone.md 5.4).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from drivers.ardrone.wire.errors import WireError

Scalar = bool | int | float | str


class Category(StrEnum):
    """The set that a key is stored in; all but COMMON may differ between multi-configuration ids."""

    COMMON = "common"
    APPLICATION = "applis"
    USER = "profiles"
    SESSION = "sessions"


class Access(StrEnum):
    """Right to write: of nobody, everybody, or only a custom (non-zero) set of ids."""

    READ = "R"
    WRITE = "RW"
    CUSTOM = "CUSTOM"


@dataclass(frozen=True, slots=True)
class ConfigKey:
    """One configuration key; the type of `default` is the type of the key.

    generation: of the drones that have it, 0 for both; double: dumped with the digits of one.
    """

    name: str
    default: Scalar
    category: Category = Category.COMMON
    access: Access = Access.WRITE
    minimum: float | None = None
    maximum: float | None = None
    generation: int = 0
    double: bool = False


_A, _U, _S = Category.APPLICATION, Category.USER, Category.SESSION
_READ, _CUSTOM, _RW = Access.READ, Access.CUSTOM, Access.WRITE
_COMMON = Category.COMMON

_KEYS = (
    ConfigKey("general:num_version_config", 1, access=_READ),
    ConfigKey("general:num_version_mb", 33, access=_READ),
    ConfigKey("general:num_version_soft", "2.3.3", access=_READ),
    ConfigKey("general:drone_serial", "XXXXXXXXXX", access=_READ),
    ConfigKey("general:soft_build_date", "2013-01-01 00:00", access=_READ),
    *(
        ConfigKey(f"general:motor{motor}_{part}", value, access=_READ)
        for motor in (1, 2, 3, 4)
        for part, value in (("soft", "1.43"), ("hard", "5.0"), ("supplier", "1.1"))
    ),
    ConfigKey("general:ardrone_name", "My ARDrone"),
    ConfigKey("general:flying_time", 0, access=_READ),
    ConfigKey("general:navdata_demo", False),
    ConfigKey("general:navdata_options", 65537, _A),
    ConfigKey("general:com_watchdog", 2, _COMMON, _RW, 0, 60),
    ConfigKey("general:video_enable", True),
    ConfigKey("general:vision_enable", True),
    ConfigKey("general:vbat_min", 9000, access=_READ),
    ConfigKey("general:localtime", 0, generation=2),
    # Calibration of one real drone's sensors: vectors and matrices are texts here.
    ConfigKey("control:accs_offset", "{ -2.1043848e+03 2.0381230e+03 1.9920460e+03 }", access=_READ),
    ConfigKey(
        "control:accs_gains",
        "{ 9.8449361e-01 7.0283208e-03 1.6613559e-02 -5.0721392e-03 9.9463403e-01 -8.1147715e-03 "
        "-3.5212679e-03 -2.4381000e-02 9.8026478e-01 }",
        access=_READ,
    ),
    ConfigKey("control:gyros_offset", "{ -2.2610001e+01 1.1600000e+01 3.0400000e+00 }", access=_READ),
    ConfigKey("control:gyros_gains", "{ 1.0666636e-03 -1.0657152e-03 -1.0655431e-03 }", access=_READ),
    ConfigKey("control:gyros110_offset", "{ 1.6625000e+03 1.6625000e+03 }", access=_READ),
    ConfigKey("control:gyros110_gains", "{ 1.5271631e-03 -1.5271631e-03 }", access=_READ),
    ConfigKey("control:magneto_offset", "{ 3.3430099e+01 -6.6152016e+01 8.9284515e+01 }", access=_READ, generation=2),
    ConfigKey("control:magneto_radius", 2.0519073e02, access=_READ, generation=2),
    ConfigKey("control:gyro_offset_thr_x", 4.0, access=_READ),
    ConfigKey("control:gyro_offset_thr_y", 4.0, access=_READ),
    ConfigKey("control:gyro_offset_thr_z", 0.5, access=_READ),
    ConfigKey("control:pwm_ref_gyros", 500, access=_READ),
    ConfigKey("control:osctun_value", 63, access=_READ),
    ConfigKey("control:osctun_test", True, access=_READ),
    ConfigKey("control:shield_enable", True, generation=1),
    ConfigKey("control:brushless", True, access=_READ, generation=1),
    ConfigKey("control:control_trim_z", 0.0, generation=1),
    ConfigKey("control:control_level", 0, _A),
    ConfigKey("control:euler_angle_max", 0.20943999, _U, _RW, 0.0, 0.52),
    ConfigKey("control:altitude_max", 3000, _COMMON, _RW, 500, 100000),
    ConfigKey("control:altitude_min", 50),
    ConfigKey("control:control_iphone_tilt", 0.34906584, _U),
    ConfigKey("control:control_vz_max", 700.0, _U, _RW, 200, 2000),
    ConfigKey("control:control_yaw", 1.7453290, _U, _RW, 0.7, 6.11),
    ConfigKey("control:outdoor", False),
    ConfigKey("control:flight_without_shell", False),
    ConfigKey("control:autonomous_flight", False),
    ConfigKey("control:manual_trim", False, _U),
    ConfigKey("control:indoor_euler_angle_max", 0.20943999, _U, _RW, 0.0, 0.52),
    ConfigKey("control:indoor_control_vz_max", 700.0, _U, _RW, 200, 2000),
    ConfigKey("control:indoor_control_yaw", 1.7453290, _U, _RW, 0.7, 6.11),
    ConfigKey("control:outdoor_euler_angle_max", 0.34906580, _U, _RW, 0.0, 0.52),
    ConfigKey("control:outdoor_control_vz_max", 1000.0, _U, _RW, 200, 2000),
    ConfigKey("control:outdoor_control_yaw", 3.4906585, _U, _RW, 0.7, 6.11),
    ConfigKey("control:flying_mode", 0, _S),
    ConfigKey("control:hovering_range", 1000, _S),
    ConfigKey("control:flight_anim", "0,0"),
    ConfigKey("network:ssid_single_player", "ardrone2"),
    ConfigKey("network:ssid_multi_player", "ardrone2"),
    ConfigKey("network:wifi_mode", 0),
    ConfigKey("network:wifi_rate", 0),
    ConfigKey("network:owner_mac", "00:00:00:00:00:00"),
    ConfigKey("network:secure", False, generation=1),
    ConfigKey("network:passkey", "9F1C3EE11CBA230B27BF1C1B6F", generation=1),
    ConfigKey("network:navdata_port", 5554, generation=1),
    ConfigKey("network:video_port", 5555, generation=1),
    ConfigKey("network:at_port", 5556, generation=1),
    ConfigKey("network:cmd_port", 5559, generation=1),
    ConfigKey("network:owner_ip_address", 0, generation=1),
    ConfigKey("network:local_ip_address", 0, generation=1),
    ConfigKey("network:broadcast_address", 0, generation=1),
    ConfigKey("pic:ultrasound_freq", 8, _COMMON, _RW, 7, 8),
    ConfigKey("pic:ultrasound_watchdog", 3),
    ConfigKey("pic:pic_version", 184877090, access=_READ),
    ConfigKey("video:camif_fps", 30, access=_READ),
    ConfigKey("video:codec_fps", 30, _S, _CUSTOM),
    ConfigKey("video:camif_buffers", 2, access=_READ),
    ConfigKey("video:num_trackers", 12, access=_READ),
    ConfigKey("video:video_codec", 129, _S, _CUSTOM),
    ConfigKey("video:video_slices", 0, _S),
    ConfigKey("video:video_live_socket", 0, _S),
    ConfigKey("video:video_storage_space", 15360, access=_READ),
    ConfigKey("video:bitrate", 1000, _A, _CUSTOM),
    ConfigKey("video:max_bitrate", 1000, _S, _CUSTOM, 250, 4000),
    ConfigKey("video:bitrate_ctrl_mode", 0, _A, _CUSTOM),
    ConfigKey("video:bitrate_storage", 4000, _A, generation=2),
    ConfigKey("video:video_channel", 0, _S),
    ConfigKey("video:video_on_usb", True, generation=2),
    ConfigKey("video:video_file_index", 1, generation=2),
    ConfigKey("leds:leds_anim", "0,0,0"),
    ConfigKey("detect:enemy_colors", 1),
    ConfigKey("detect:groundstripe_colors", 16, _S),
    ConfigKey("detect:enemy_without_shell", 0),
    ConfigKey("detect:detect_type", 3, _S),
    ConfigKey("detect:detections_select_h", 0, _S),
    ConfigKey("detect:detections_select_v_hsync", 0, _S),
    ConfigKey("detect:detections_select_v", 0, _S),
    ConfigKey("syslog:output", 7),
    ConfigKey("syslog:max_size", 102400),
    ConfigKey("syslog:nb_files", 5),
    ConfigKey("userbox:userbox_cmd", "0", _S, generation=2),
    ConfigKey("gps:latitude", 500.0, _S, generation=2, double=True),
    ConfigKey("gps:longitude", 500.0, _S, generation=2, double=True),
    ConfigKey("gps:altitude", 0.0, _S, generation=2, double=True),
    ConfigKey("custom:application_id", "00000000", _S),
    ConfigKey("custom:profile_id", "00000000", _S),
    ConfigKey("custom:session_id", "00000000", _S),
    ConfigKey("custom:application_desc", "Default application configuration", _A),
    ConfigKey("custom:profile_desc", "Default profile configuration", _U),
    ConfigKey("custom:session_desc", "Default session configuration", _S),
)
CONFIGURATION: dict[str, ConfigKey] = {key.name: key for key in _KEYS}


def parse_value(name: str, text: str) -> Scalar:
    """Return the value a CONFIG command sets a key to, clamped to the key's range.

    Keys and booleans are accepted in any case, as real drones do. Raises WireError (unknown_key, value).
    """
    key = CONFIGURATION.get(name.lower())
    if key is None:
        raise WireError("unknown_key", name)
    try:
        value = _parse(text.strip(), key.default)
    except (ValueError, OverflowError) as error:
        raise WireError("value", f"{name} = {text!r}") from error
    return _clamp(key, value)


def _parse(text: str, like: Scalar) -> Scalar:
    if isinstance(like, bool):
        if text.upper() not in ("TRUE", "FALSE"):
            raise ValueError(text)
        return text.upper() == "TRUE"
    if isinstance(like, int):
        return int(text)
    if isinstance(like, float):
        value = float(text)
        if value - value != 0.0:  # an infinity or not a number
            raise ValueError(text)
        return value
    return text


def _clamp(key: ConfigKey, value: Scalar) -> Scalar:
    if isinstance(value, str | bool):
        return value
    if key.minimum is not None and value < key.minimum:
        return type(value)(key.minimum)
    if key.maximum is not None and value > key.maximum:
        return type(value)(key.maximum)
    return value


def format_value(value: Scalar) -> str:
    """Return the text of a value in CONFIG commands and dumps: TRUE/FALSE, decimal, %.7e."""
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if isinstance(value, float):
        return f"{value:.7e}"
    return str(value)


def format_dump(values: Mapping[str, Scalar]) -> bytes:
    """Return the configuration dump of TCP port 5559: `key = value` lines ended by a NUL."""
    lines = []
    for name, value in values.items():
        key = CONFIGURATION.get(name)
        double = key is not None and key.double and isinstance(value, float)
        lines.append(f"{name} = {f'{value:.16e}' if double else format_value(value)}\n")
    return "".join(lines).encode("latin-1") + b"\0"


def format_custom_dump(sets: Mapping[Category, Mapping[str, str]]) -> bytes:
    """Return the answer to CTRL 6: the ids and descriptions of each category's sets.

    WIRE: a header `[applis]`, `[profiles]`, `[sessions]`, then `id,description`, each ended by CR; a NUL at the end.
    """
    lines = []
    for category, described in sets.items():
        lines.append(f"[{category.value}]\r")
        lines += [f"{name},{description}\r" for name, description in described.items()]
    return "".join(lines).encode("latin-1", "replace") + b"\0"
