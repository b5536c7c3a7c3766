"""Truth from motion capture: tracks without impossible poses, on the ground while the drone reports so."""

import math

import msgspec
import numpy as np
from matplotlib.figure import Figure

from groundstation.arrays import Array
from groundstation.bus.messages import (
    AckStage,
    BodyPose,
    BodyPoses,
    Command,
    CommandAck,
    FlightState,
    Header,
    VehicleStatus,
    Verb,
)
from groundstation.field.resolved import ResolvedField
from groundstation.report.accuracy import accuracy
from groundstation.report.captured_truth import captured_tracks
from groundstation.report.criteria import criteria_of
from groundstation.report.metrics import figures_of
from groundstation.report.plot_map import draw_map
from groundstation.report.run_facts import RunFacts
from groundstation.report.safety import landed, min_separation_m
from groundstation.report.tracks import EstimateTrack, RunData, TimedMessage, TruthTrack


def poses(time_s: float, x: float, refused: dict[str, str] | None = None) -> TimedMessage[BodyPoses]:
    turn = (math.cos(0.25), 0.0, 0.0, math.sin(0.25))
    bodies = (BodyPose("drone_1", (x, 1.0, 1.5), turn), BodyPose("turtlebot", (2.0, 0.0, 0.0), turn))
    header = Header(0, "c", "mocap", "mocap", 1)
    return TimedMessage(time_s, BodyPoses(header=header, bodies=bodies, refused=refused or {}))


def status(time_s: float, state: FlightState) -> TimedMessage[VehicleStatus]:
    header = Header(0, "c", "drone_1", "drone_1", 1)
    return TimedMessage(time_s, VehicleStatus(header=header, flight_state=state, mode="TRACK"))


def test_tracks_hold_what_can_be_true_and_who_flew() -> None:
    heard = [poses(0.0, 0.0), poses(1.0, 0.1), poses(2.0, 9.0, {"drone_1": "jumped"}), poses(3.0, 0.3)]
    said = {"drone_1": [status(0.5, FlightState.HOVERING), status(2.5, FlightState.LANDED)]}
    tracks = captured_tracks(heard, said)
    assert tracks["drone_1"].position_m[:, 0].tolist() == [0.0, 0.1, 0.3]
    assert np.allclose(tracks["drone_1"].yaw_rad, 0.5)
    assert tracks["drone_1"].on_ground.tolist() == [True, False, True]
    assert tracks["turtlebot"].on_ground.all() and len(tracks["turtlebot"].time_s) == 4


def test_a_drone_that_is_not_heard_any_more_flies_on() -> None:
    said = {"drone_1": [status(0.5, FlightState.HOVERING), status(1.5, FlightState.LOST)]}
    track = captured_tracks([poses(time_s, 0.0) for time_s in (0.0, 1.0, 2.0, 3.0)], said)["drone_1"]
    assert track.on_ground.tolist() == [True, False, False, False]


def track(*times_s: float, x: float = 0.0, on_ground: bool = False) -> TruthTrack:
    heard = [poses(time_s, x) for time_s in times_s]
    said = {} if on_ground else {"drone_1": [status(-1.0, FlightState.HOVERING)]}
    return captured_tracks(heard, said)["drone_1"]


def still(times_s: Array, x: float) -> EstimateTrack:
    return EstimateTrack(
        "target", times_s, np.tile([x, 1.0], (len(times_s), 1)), np.tile(np.eye(2), (len(times_s), 1, 1))
    )


def test_nobody_knows_where_a_body_was_that_was_not_seen() -> None:
    """It went 4 m aside in a gap of two seconds: neither a line between its ends nor its last position is truth."""
    heard = [*(poses(t / 10, 0.0) for t in range(11)), *(poses(3.0 + t / 10, 4.0) for t in range(11))]
    seen = captured_tracks(heard, {})["drone_1"]
    times = np.array([-0.2, 0.55, 1.0, 2.0, 3.0, 3.5, 4.2])
    assert seen.known_at(times).tolist() == [False, True, True, False, True, True, False]
    assert np.isnan(seen.position_at(times[[3, 6]])).all() and np.isnan(seen.yaw_at(times[[3, 6]])).all()
    assert not seen.airborne_at(times[[3, 6]]).any()
    grid = np.arange(0.0, 6.0, 0.1)
    judged = accuracy(grid, seen, still(grid, 0.0), 2)
    assert judged is not None and abs(judged.judged - 21 / 60) <= 1 / 60
    assert judged.covered == 1.0, "what is not judged is no estimate that is missing"
    assert accuracy(np.array([9.0]), seen, still(grid, 0.0), 2) is None
    slow = captured_tracks([poses(0.0, 0.0), poses(1.0, 0.0)], {}, rate_hz=2.0)["drone_1"]
    assert slow.known_at(np.array([0.5])).all(), "a system of two frames a second is known between them"


def test_no_line_is_drawn_where_a_body_was_not_seen(lab_field: ResolvedField) -> None:
    heard = [*(poses(t / 10, 0.0) for t in range(11)), *(poses(3.0 + t / 10, 4.0) for t in range(11))]
    data = RunData(lab_field, RunFacts(), end_s=4.0, truth={"drone_1": captured_tracks(heard, {})["drone_1"]})
    axes = Figure().subplots()
    draw_map(axes, data)
    paths = [line.get_xdata() for line in axes.lines if len(np.asarray(line.get_xdata())) > 1]
    assert sorted(float(np.ptp(np.asarray(path))) for path in paths) == [0.0, 0.0]


def test_drones_come_near_each_other_only_where_both_were_seen(lab_field: ResolvedField) -> None:
    along = track(*(t / 10 for t in range(41)), x=2.0)
    crossing = captured_tracks([poses(0.0, 0.0), poses(0.1, 0.0), poses(3.9, 4.0), poses(4.0, 4.0)],
                               {"drone_1": [status(-1.0, FlightState.HOVERING)]})["drone_1"]  # fmt: skip
    data = RunData(lab_field, RunFacts(), truth={"drone_1": along, "drone_2": crossing})
    assert min_separation_m(data) == 2.0


def test_a_drone_that_was_seen_on_its_pad_only_is_not_called_landed(lab_field: ResolvedField) -> None:
    """The system ended before the take-off; the drone last reported flight."""
    ended = track(0.0, 0.1, 0.2, on_ground=True)
    said = {name: [status(0.0, FlightState.LANDED)] for name in lab_field.drones}
    data = RunData(lab_field, RunFacts(), truth=dict.fromkeys(lab_field.drones, ended), vehicles=said)
    data.vehicles["drone_1"].append(status(5.0, FlightState.HOVERING))
    assert landed(data) is False
    data.vehicles["drone_1"].append(status(9.0, FlightState.LANDED))
    assert landed(data) is True


def test_a_flight_that_was_judged_for_less_than_half_of_its_time_does_not_pass(lab_field: ResolvedField) -> None:
    header = Header(0, "c", "drone_1", "drone_1", 1)
    began = CommandAck(header=header, command_id="1", verb=Verb.TRACK, stage=AckStage.EFFECTIVE)
    ended = Command(header=header, id="2", verb=Verb.LAND, scope=(), issuer="me")
    grid = np.arange(0.0, 20.0, 0.05)
    for seen_s, good in ((4.0, False), (16.0, True)):
        heard = [poses(t / 10, 0.0) for t in range(int(10 * seen_s))]
        data = RunData(
            lab_field,
            RunFacts(),
            truth={"turtlebot": captured_tracks(heard, {})["turtlebot"]},
            estimates={
                "turtlebot": EstimateTrack(
                    "target", grid, np.tile([2.0, 0.0], (len(grid), 1)), np.tile(np.eye(2), (len(grid), 1, 1))
                )
            },
            acks=[TimedMessage(0.0, began)],
            commands=[TimedMessage(20.0, ended)],
        )
        found = {one.name: one for one in criteria_of(figures_of(data), lab_field, RunFacts())}
        assert found["target_rmse_m"].ok
        assert found["target_judged"].ok is good
        two = msgspec.structs.replace(
            lab_field, target=None, targets=dict.fromkeys(("turtlebot", "rover"), lab_field.target)
        )
        found = {one.name: one for one in criteria_of(figures_of(data), two, RunFacts())}
        assert (found["target_judged"].value, found["target_judged"].ok) == (0.0, False), "nothing shows the rover"


def aloft(field: ResolvedField, seen_s: float, place_m: float = 0.0) -> RunData:
    """Return a flight of 20 s without a target: motion capture sees both drones, 0.2 m apart, for a time."""
    said = {name: [status(0.0, FlightState.HOVERING), status(20.0, FlightState.LANDED)] for name in field.drones}
    places = {name: (place_m + 0.2 * k, 0.0, 1.5) for k, name in enumerate(field.drones)}
    bodies = tuple(BodyPose(name, place, (1.0, 0.0, 0.0, 0.0)) for name, place in places.items())
    header = Header(0, "c", "mocap", "mocap", 1)
    heard = [TimedMessage(t / 10, BodyPoses(header=header, bodies=bodies)) for t in range(int(10 * seen_s))]
    return RunData(field, RunFacts(), end_s=21.0, truth=captured_tracks(heard, said), vehicles=said)


def test_fence_and_separation_are_judged_although_the_target_was_never_seen(lab_field: ResolvedField) -> None:
    """Neither was anything tracked: the drones only hovered."""
    data = aloft(lab_field, 20.0, place_m=9.0)
    found = {one.name: one for one in criteria_of(figures_of(data), lab_field, RunFacts())}
    assert found["max_fence_violation_m"].value is not None and not found["max_fence_violation_m"].ok
    assert not found["min_separation_m"].ok and found["landed"].ok
    assert not found.keys() & {"target_rmse_m", "target_lost_s", "mean_cpu_cores"}, "there is no error of a target"


def test_a_flight_that_nobody_measured_kept_no_fence(lab_field: ResolvedField) -> None:
    data = aloft(lab_field, 20.0)
    assert figures_of(data).drones_judged == dict.fromkeys(lab_field.drones, 1.0)
    for seen_s, good in ((1.0, False), (14.0, True)):
        short = aloft(lab_field, seen_s)
        found = {one.name: one for one in criteria_of(figures_of(short), lab_field, RunFacts())}
        assert found["max_fence_violation_m"].ok
        assert found["drones_judged"].ok is good
        assert abs(min(figures_of(short).drones_judged.values()) - seen_s / 20.0) < 0.02
    del short.truth["drone_2"]
    assert figures_of(short).drones_judged["drone_2"] == 0.0
    assert figures_of(RunData(lab_field, RunFacts(), end_s=21.0, vehicles=data.vehicles)).drones_judged == {}


def test_the_share_of_a_drone_that_is_judged_is_that_of_its_time_in_the_air(lab_field: ResolvedField) -> None:
    header = Header(0, "c", "drone_1", "drone_1", 1)
    data = aloft(lab_field, 4.0)
    data.acks.append(
        TimedMessage(0.0, CommandAck(header=header, command_id="1", verb=Verb.TRACK, stage=AckStage.EFFECTIVE))
    )
    data.commands.append(TimedMessage(20.0, Command(header=header, id="2", verb=Verb.LAND, scope=(), issuer="me")))
    assert abs(figures_of(data).robots["drone_1"].judged - 0.2) < 0.02
