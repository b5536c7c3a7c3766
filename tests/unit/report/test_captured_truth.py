"""Truth by motion capture: tracks of bodies, without poses that cannot be true, on the ground while a drone says so."""

import math

import numpy as np

from groundstation.bus.messages import BodyPose, BodyPoses, FlightState, Header, VehicleStatus
from groundstation.report.captured_truth import captured_tracks
from groundstation.report.tracks import TimedMessage


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
