"""Pre-flight findings about each camera's pictures, the links and the vehicles."""

from typing import Any

import pytest
from msgspec.structs import replace

from groundstation.bus.messages import CameraStatus, FlightState, Header, VehicleStatus
from groundstation.doctor.finding import Finding, Level
from groundstation.field.resolved import ResolvedField
from groundstation.field.targets import TargetOdometry
from groundstation.preflight.health import camera_findings, drone_findings


def findings(field: ResolvedField, **picture: float) -> list[Finding]:
    header = Header(0, "c", "ceiling", "ceiling", 1)
    status = CameraStatus(
        header=header, connected=True, fps=15.0, age_ms=130.0, frames=99, skipped=0, detections=42,
        brightness=picture.get("brightness"), edge_px=picture.get("edge_px"),
    )  # fmt: skip
    found = camera_findings(field, {"ceiling": status}, {"ceiling": ["drone_1", "drone_2"]})
    return [one for one in found if one.subject == "ceiling"]


def test_a_good_picture_is_one_line_with_rate_age_and_whose_markers_are_seen(lab_field: ResolvedField) -> None:
    (one,) = findings(lab_field, brightness=0.49, edge_px=2.1)
    assert one.level is Level.OK
    assert one.found == "15 pictures/s, 130 ms old, 42 sightings, sees drone_1, drone_2"


@pytest.mark.parametrize(
    ("picture", "words"),
    [
        ({"brightness": 0.03, "edge_px": 2.5}, "too dark (mean 3% of white)"),
        ({"brightness": 0.96}, "too bright (mean 96% of white)"),
        ({"brightness": 0.5, "edge_px": 8.2}, "blurred: the sharpest edges are 8 pixels wide"),
    ],
)
def test_a_bad_picture_is_named_with_its_remedy(
    lab_field: ResolvedField, picture: dict[str, float], words: str
) -> None:
    _, worse = findings(lab_field, **picture)
    assert worse.level is Level.SHOULD and words in worse.found and worse.remedy


def findings_of(field: ResolvedField, rate_hz: float, **told: Any) -> list[Finding]:
    """Return the findings about a drone on the ground, healthy except for these facts."""
    header = Header(0, "here", "drone_1", "drone_1", 1)
    status = VehicleStatus(
        header=header, flight_state=FlightState.LANDED, mode="LANDED", battery=0.9, rate_hz=rate_hz, **told
    )
    return list(drone_findings(field, {"drone_1": status}))


@pytest.mark.parametrize(
    ("detail", "found", "remedy"),
    [
        ("system 1 answers here, the field says 11: set mavlink.system_id",
         "system 1 answers here, the field says 11", "set mavlink.system_id"),
        ("waiting for its heartbeat", "waiting for its heartbeat", "check its power, its network and 192.168.1.11"),
    ],
)  # fmt: skip
def test_who_answers_wrongly_is_sent_to_the_setting_and_not_to_the_power(
    lab_field: ResolvedField, detail: str, found: str, remedy: str
) -> None:
    status = VehicleStatus(
        header=Header(0, "here", "drone_1", "drone_1", 1), flight_state=FlightState.UNKNOWN, mode="CONNECTING",
        detail=detail,
    )  # fmt: skip
    one = next(iter(drone_findings(lab_field, {"drone_1": status})))
    assert (one.found, one.remedy) == (found, remedy)


def test_two_senders_of_one_number_are_told_with_the_remedy(lab_field: ResolvedField) -> None:
    told = "a second address sends with its system id 11: set an id of its own on each vehicle"
    (one,) = (one for one in findings_of(lab_field, 50.0, not_ready=told) if "system id" in one.found)
    assert one.found == "it refuses to take off: a second address sends with its system id 11"
    assert one.remedy == "set an id of its own on each vehicle"


def clock_findings(field: ResolvedField, drift_ppm: float | None, late_ms: float | None) -> list[Finding]:
    found = findings_of(field, 200.0, clock_drift_ppm=drift_ppm, telemetry_late_ms=late_ms)
    return [one for one in found if one.subject == "drone_1" and "battery" not in one.found]


@pytest.mark.parametrize(("share", "told"), [(None, 0), (0.0, 1), (0.4, 1), (0.95, 0)])
def test_a_link_over_which_nothing_or_little_arrives_is_told(
    lab_field: ResolvedField, share: float | None, told: int
) -> None:
    found = [one for one in findings_of(lab_field, 50.0, link_quality=share) if "of it arrives" in one.found]
    assert len(found) == told and all(one.level is Level.SHOULD and one.remedy for one in found)


@pytest.mark.parametrize(("asks", "told"), [(None, 0), (True, 0), (False, 1)])
def test_a_vehicle_that_does_not_ask_for_our_time_is_told(
    lab_field: ResolvedField, asks: bool | None, told: int
) -> None:
    found = [one for one in findings_of(lab_field, 50.0, asks_time=asks) if "TIMESYNC" in one.found]
    assert len(found) == told and all(one.level is Level.SHOULD and one.remedy for one in found)


def test_clocks_are_graded_by_how_fast_they_go_and_how_late_they_are_heard(lab_field: ResolvedField) -> None:
    assert clock_findings(lab_field, None, None) == []
    (good,) = clock_findings(lab_field, -40.0, 150.0)
    assert (good.level, good.found, good.remedy) == (Level.OK, "its clock goes 40 ppm slow", "")
    fast, late = clock_findings(lab_field, 1001.0, 151.0)
    assert (fast.level, fast.found) == (Level.SHOULD, "its clock goes 1001 ppm fast") and fast.remedy
    assert (late.level, late.found) == (Level.SHOULD, "its telemetry comes up to 151 ms late") and late.remedy
    assert [one.level for one in clock_findings(lab_field, -1001.0, None)] == [Level.SHOULD]


@pytest.mark.parametrize(
    ("not_ready", "found", "remedy"),
    [
        (
            "parameter EKF2_EV_CTRL: is 0, should be 15: groundstation mavlink setup --apply",
            "it refuses to take off: parameter EKF2_EV_CTRL: is 0, should be 15",
            "groundstation mavlink setup --apply",
        ),
        ("it has no position yet", "it refuses to take off: it has no position yet", "do what it asks for"),
    ],
)
def test_a_standing_drone_that_is_not_ready_says_why_with_its_remedy(
    lab_field: ResolvedField, not_ready: str, found: str, remedy: str
) -> None:
    header = Header(0, "c", "drone_1", "drone_1", 1)
    status = VehicleStatus(
        header=header, flight_state=FlightState.LANDED, mode="LANDED", battery=0.9, rate_hz=200.0,
        not_ready=not_ready, firmware="PX4 1.15",
    )  # fmt: skip
    first, second, *_ = [one for one in drone_findings(lab_field, {"drone_1": status}) if one.subject == "drone_1"]
    assert (first.level, first.found) == (Level.SHOULD, found) and first.remedy.startswith(remedy)
    assert (second.level, second.found) == (Level.OK, "firmware PX4 1.15")


def test_a_targets_odometry_is_a_finding_whether_it_flows_or_is_silent(lab_field: ResolvedField) -> None:
    told = TargetOdometry(source="ros2://10.0.0.9/odom")
    assert lab_field.target is not None
    field = replace(lab_field, target=replace(lab_field.target, odometry=told))
    (name,) = field.reporting
    header = Header(0, "c", name, name, 1)
    silent = CameraStatus(
        header=header,
        connected=False,
        fps=0.0,
        age_ms=9e3,
        frames=0,
        skipped=0,
        detections=0,
        detail="no report for 5 s",
    )
    flows = replace(silent, connected=True, fps=20.0, age_ms=31.0, detections=40, detail="")
    lines = [
        next(one for one in camera_findings(field, statuses) if one.subject == name)
        for statuses in ({}, {name: silent}, {name: flows})
    ]
    assert [one.level for one in lines] == [Level.SHOULD, Level.SHOULD, Level.OK]
    assert [one.found for one in lines] == [
        "nothing arrives", "no report for 5 s", "20 reports/s, 31 ms old, 40 used"
    ]  # fmt: skip
    assert "cameras track the target meanwhile" in lines[0].remedy
