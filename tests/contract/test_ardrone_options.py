"""Each navdata option against offsets copied by hand from docs/reference/ardrone.md 4.4: bytes in, fields out."""

import struct

import pytest

from drivers.ardrone.wire import ambient, options, vision
from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.tags import OPTION_SIZES

# layout, size of the option, {field: (offset in the option with its head, format, value)}
SHEET = [
    (options.DEMO, 148, {"num_frames": (40, "I", 7), "vz_mm_s": (36, "f", -3.5), "altitude_mm": (24, "i", -5)}),
    (
        options.DEMO_DETECTION,
        148,
        {
            "camera_rotation": (44, "9f", tuple(range(1, 10))), "camera_translation": (80, "3f", (1.0, 2.0, 3.0)),
            "tag_index": (92, "I", 2), "camera_type": (96, "I", 3),
            "drone_camera_translation": (136, "3f", (4, 5, 6)),
        },
    ),
    (
        options.RAW_MEASURES,
        52,
        {
            "accelerometers": (4, "3H", (2040, 2036, 2528)), "gyros": (10, "3h", (-3, 4, -5)),
            "gyros_110": (16, "2h", (8, -9)), "battery_mv": (20, "I", 11686), "us_start_echo": (24, "H", 1),
            "us_end_echo": (26, "H", 2), "us_association_echo": (28, "H", 3758), "us_distance_echo": (30, "H", 3),
            "us_curve_time": (32, "H", 4), "us_curve_value": (34, "H", 5), "us_curve_ref": (36, "H", 6),
            "echo_flag": (38, "H", 7),
        },
    ),
    (
        options.RAW_ECHOES,
        52,
        {"echoes": (40, "H", 1), "echo_sum": (42, "I", 9), "altitude_mm": (46, "i", 243), "gradient": (50, "h", -4)},
    ),
    (
        options.PHYS_MEASURES,
        46,
        {
            "accelerometer_temperature_c": (4, "f", 45.0), "gyro_temperature": (8, "H", 12),
            "accelerations_mg": (10, "3f", (80.0, -33.0, -942.0)), "rates_deg_s": (22, "3f", (1.0, -2.0, 3.0)),
            "supply_3v3": (34, "I", 1), "gyro_reference_epson": (38, "I", 2), "gyro_reference_idg": (42, "I", 3),
        },
    ),
    (options.GYROS_OFFSETS, 16, {"offsets_deg_s": (4, "3f", (0.5, -0.5, 1.5))}),
    (options.REFERENCES, 88, {"theta_mdeg": (4, "i", -9), "yaw_mdeg_s": (28, "i", 5), "psi_mdeg": (32, "i", -7)}),
    (
        options.SPEED_REFERENCES,
        88,
        {
            "vx_mm_s": (36, "f", 100.0), "vy_mm_s": (40, "f", -50.0), "theta_model_rad": (44, "f", 0.5),
            "gain_x": (52, "f", 2.0), "mode": (60, "I", 3), "time": (64, "f", 0.25), "psi_accuracy": (80, "f", 0.125),
            "sequence": (84, "i", 4711),
        },
    ),
    (options.TRIMS, 16, {"yaw_rate": (4, "f", 0.5), "theta": (8, "f", 0.25), "phi": (12, "f", -0.25)}),
    (
        options.RC_REFERENCES,
        24,
        {"pitch": (4, "i", 1), "roll": (8, "i", -2), "yaw": (12, "i", 3), "climb": (16, "i", -4),
         "agility": (20, "i", 5)},
    ),
    (
        options.PWM,
        76,
        {
            "motors": (4, "4B", (170, 171, 169, 168)), "saturation": (8, "4B", (255,) * 4),
            "climb_feed_forward": (12, "f", 1.0), "vz_reference_mm_s": (24, "f", 4.0), "pitch": (28, "i", -1),
            "yaw_integral": (40, "f", 2.0), "yaw_planned": (52, "i", 6), "climb_planned": (56, "f", 3.0),
            "currents_ma": (60, "4H", (1, 2, 3, 4)),
        },
    ),
    (options.PWM_ALTITUDE, 76, {"proportional": (68, "f", 1.5), "derivative": (72, "f", -1.5)}),
    (
        options.ALTITUDE,
        56,
        {
            "vision_mm": (4, "i", 760), "vz_mm_s": (8, "f", -20.0), "reference_mm": (12, "i", 800),
            "raw_mm": (16, "i", 755), "observed_acceleration_m_s2": (20, "f", 0.5),
            "observed_altitude_m": (24, "f", 0.75),
            "observer_x": (28, "3f", (1, 2, 3)), "observer_state": (40, "I", 4), "estimated_vb": (44, "2f", (5, 6)),
            "estimator_state": (52, "I", 7),
        },
    ),
    (vision.VISION_RAW, 16, {"translation": (4, "3f", (1, 2, 3))}),
    (vision.VISION_OF, 44, {"dx": (4, "5f", (1, 2, 3, 4, 5)), "dy": (24, "5f", (6, 7, 8, 9, 10))}),
    (
        vision.VISION,
        92,
        {
            "state": (4, "I", 1), "misc": (8, "i", -2), "phi_trim_rad": (12, "f", 0.5),
            "theta_reference_rad": (24, "f", 1.5),
            "new_picture": (28, "i", 3), "psi_capture": (40, "f", 2.5), "altitude_capture_mm": (44, "i", 700),
            "time_capture": (48, "I", 9), "body_velocity_mm_s": (52, "3f", (10, 20, 30)),
            "delta_psi": (72, "f", 0.25),
            "gold_defined": (76, "I", 1), "gold_reset": (80, "I", 2), "gold_x": (84, "f", 3), "gold_y": (88, "f", 4),
        },
    ),
    (vision.VISION_PERF, 108, {"size_orientation": (4, "f", 1), "update": (24, "f", 2),
     "custom": (28, "20f", tuple(range(20)))}),
    (vision.TRACKERS_SEND, 364, {"locked": (4, "30i", tuple(range(30))), "points": (124, "60i", tuple(range(60)))}),
    (
        vision.VISION_DETECT,
        328,
        {
            "detected": (4, "I", 2), "types": (8, "4I", (1, 2, 3, 4)), "x": (24, "4I", (5, 6, 7, 8)),
            "y": (40, "4I", (9, 10, 11, 12)), "width": (56, "4I", (1, 1, 2, 2)), "height": (72, "4I", (3, 3, 4, 4)),
            "distance_cm": (88, "4I", (100, 200, 300, 400)), "orientation_deg": (104, "4f", (90, -90, 0, 45)),
        },
    ),
    (
        vision.VISION_DETECT_POSES,
        328,
        {
            "rotations": (120, "36f", tuple(range(36))), "translations": (264, "12f", tuple(range(12))),
            "sources": (312, "4I", (0, 1, 2, 0)),
        },
    ),
    (ambient.WATCHDOG, 8, {"value": (4, "i", 4822)}),
    (ambient.ADC_DATA_FRAME, 40, {"version": (4, "I", 1), "frame": (8, "32s", bytes(range(32)))}),
    (
        vision.VIDEO_STREAM,
        65,
        {
            "quantizer": (4, "B", 30), "frame_bytes": (5, "I", 4711), "frame_number": (9, "I", 99),
            "at_sequence": (13, "I", 1234), "at_mean_gap_ms": (17, "I", 30), "at_gap_variance": (21, "f", 2.0),
            "at_quality": (25, "I", 1),
        },
    ),
    (
        vision.VIDEO_STREAM_RATE,
        65,
        {
            "bitrate": (29, "I", 1000), "wanted_bitrate": (33, "I", 1500), "data": (37, "5i", (1, 2, 3, 4, 5)),
            "tcp_queue": (57, "I", 6), "fifo_queue": (61, "I", 7),
        },
    ),
    (vision.GAMES, 12, {"double_taps": (4, "I", 1), "finish_lines": (8, "I", 2)}),
    (
        ambient.PRESSURE_RAW,
        18,
        {
            "pressure_lsb": (4, "i", 33000), "temperature_lsb": (8, "h", -4),
            "temperature_decidegree": (10, "i", 435),
            "pressure_pa": (14, "i", 101586),
        },
    ),
    (
        ambient.MAGNETO,
        75,
        {
            "counts": (4, "3h", (30, -56, 80)), "raw_mg": (10, "3f", (1, 2, 3)),
            "rectified_mg": (22, "3f", (4, 5, 6)),
            "offset_mg": (34, "3f", (7, 8, 9)), "heading_deg": (46, "f", 1.5), "heading_gyro_deg": (50, "f", 2.5),
            "heading_fusion_deg": (54, "f", 1.875), "calibrated": (58, "B", 1), "state": (59, "I", 3),
            "radius_mg": (63, "f", 4), "error_mean": (67, "f", 5), "error_variance": (71, "f", 6),
        },
    ),
    (
        ambient.WIND,
        56,
        {
            "speed_m_s": (4, "f", 1), "angle": (8, "f", 2), "theta_compensation_rad": (12, "f", 3),
            "phi_compensation_rad": (16, "f", 4), "states": (20, "6f", (1, 2, 3, 4, 5, 6)),
            "magneto_debug": (44, "3f", (7, 8, 9)),
        },
    ),
    (
        ambient.KALMAN_PRESSURE,
        72,
        {
            "offset_pressure_pa": (4, "f", 1), "height_mm": (8, "f", 2), "climb_m_s": (12, "f", 3),
            "bias_pwm": (16, "f", 4),
            "offset_ultrasound_m": (24, "f", 5), "speed_covariance": (40, "f", 6), "ground_effect": (44, "I", 7),
            "innovation_sum_mm": (48, "f", 8), "ultrasound_rejected": (52, "I", 9), "multisinus": (56, "f", 10),
            "climb_altitude": (60, "f", 11), "multisinus_flag": (64, "I", 12), "multisinus_start_flag": (68, "I", 13),
        },
    ),
    (
        vision.HDVIDEO_STREAM,
        32,
        {
            "state": (4, "I", 1), "queued_packets": (8, "I", 2), "queued_bytes": (12, "I", 3),
            "stick_kb": (16, "I", 4),
            "stick_free_kb": (20, "I", 5), "frame_number": (24, "I", 6), "remaining_s": (28, "I", 7),
        },
    ),
    (ambient.WIFI, 8, {"link_quality": (4, "I", 1061997773)}),
    (ambient.ZIMMU_3000, 12, {"vz_lsb": (4, "i", -3), "vz": (8, "f", 0.5)}),
    (
        ambient.GPS,
        216,
        {
            "latitude_deg": (4, "d", 34.0905016), "longitude_deg": (12, "d", -118.2766877),
            "elevation_m": (20, "d", 122.64),
            "hdop": (28, "d", 1.0), "available": (36, "i", 1), "waypoint_validated": (44, "i", 2),
            "latitude_0_deg": (48, "d", 1.5), "longitude_fused_deg": (72, "d", 2.5), "state": (80, "I", 3),
            "controller": (84, "10f", tuple(range(10))), "vdop": (124, "d", 4), "pdop": (132, "d", 5),
            "speed": (140, "f", 6),
            "last_frame_timestamp": (144, "I", 7), "degree": (148, "f", 8), "degree_magnetic": (152, "f", 9),
            "ehpe": (156, "f", 10), "ehve": (160, "f", 11), "c_n0": (164, "f", 12), "satellites": (168, "I", 13),
            "channels": (172, "24B", tuple(range(24))), "plugged": (196, "i", 1), "ephemeris_status": (200, "I", 14),
            "vx": (204, "f", 15), "vy": (208, "f", 16), "firmware_status": (212, "I", 17),
        },
    ),
]  # fmt: skip


@pytest.mark.parametrize(
    ("layout", "size", "fields"), SHEET, ids=lambda v: getattr(getattr(v, "tag", None), "name", "")
)
def test_fields_stand_where_the_sheet_says(layout, size, fields):
    payload = bytearray(size)
    for offset, form, value in fields.values():
        struct.pack_into("<" + form, payload, offset, *(value if isinstance(value, tuple) else (value,)))
    read = Navdata(0, 1, 0, ((layout.tag, bytes(payload[4:])),)).read(layout)
    assert read is not None
    assert {name: getattr(read, name) for name in fields} == {name: value for name, (_, _, value) in fields.items()}
    assert layout.encode(read, size)[layout.start - 4 :] == bytes(payload[layout.start :]).ljust(
        size - layout.start, b"\0"
    )


def test_every_option_of_every_firmware_has_a_layout():
    known = {layout.tag for layout in options.LAYOUTS}
    assert known == {tag for sizes in OPTION_SIZES.values() for tag in sizes}
    assert {id(layout) for layout, _, _ in SHEET} >= {id(layout) for layout in options.LAYOUTS} - {
        id(options.TIME), id(options.EULER_ANGLES),  # in the golden tests
    }  # fmt: skip


@pytest.mark.parametrize("profile", OPTION_SIZES)
def test_every_layout_reads_every_firmware_or_says_that_it_is_not_there(profile):
    sizes = OPTION_SIZES[profile]
    packet = Navdata(0, 1, 0, tuple((tag, bytes(size - 4)) for tag, size in sizes.items()))
    missing = {f"{layout.tag.name}:{layout.start}" for layout in options.LAYOUTS if packet.read(layout) is None}
    if profile.startswith("ar1"):
        assert {"RAW_MEASURES:40", "REFERENCES:36", "PWM:68", "VISION_DETECT:120", "VIDEO_STREAM:29"} <= missing
        assert not {name for name in missing if name.endswith(":4")} - {
            f"{layout.tag.name}:4" for layout in options.LAYOUTS if layout.tag > 20
        }
    else:
        assert missing == {"GPS:4"}, "tag 27 is one of its two meanings"


def test_sizes_of_whole_packets():
    totals = {profile: 16 + sum(sizes.values()) + 8 for profile, sizes in OPTION_SIZES.items()}
    assert totals["ar1-1.7"] == 1327
    assert totals["ar2-2.3"] == 1916
    assert totals["ar2-2.4-beta"] == 2384
    assert totals["ar2-2.4.8"] == 1916 + 16 + 8 + 8 + 204
