"""Times on the board: since when something counts, and since when a drone is in the air."""

import json
from typing import Any

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.api import Received
from groundstation.bus.keys import Key
from groundstation.bus.topics import Topic
from groundstation.console.snapshot import Snapshot
from groundstation.console.state import ConsoleState
from groundstation.monitor.state import Cast
from groundstation.time_units import NS_PER_S


def header(entity: str, stamp_ns: int) -> m.Header:
    return m.Header(stamp_ns, "c", entity, "s", 0)


def received(topic: Topic, message: m.Message, arrived_ns: int = 0) -> Received:
    return Received(Key("lab", message.header.entity, topic, "s"), message.header, message, b"", arrived_ns)


def shown(state: ConsoleState) -> dict[str, Any]:
    board = Snapshot()
    board.begin()
    state.put(board, NS_PER_S)
    state.put_often(board, NS_PER_S)
    said: dict[str, Any] = json.loads(board.since(-1))
    return said


def test_what_is_dated_ahead_counts_from_its_arrival() -> None:
    state, ahead_ns = ConsoleState(Cast(), 0), 3600 * NS_PER_S
    head = header("drone_1", ahead_ns)
    status = m.VehicleStatus(header=head, flight_state=m.FlightState.FLYING, mode="TRACK", battery=0.5)
    setpoint = m.VelocitySetpoint(header=head, velocity_m_s=(0.1, 0, 0), yaw_rate_rad_s=0.2, lifetime_ms=300, epoch=3)
    estimate = m.Estimate(header=header("team", ahead_ns), entities=(), epoch=3)
    for topic, message in ((t.VEHICLE_STATUS, status), (t.SETPOINT, setpoint), (t.ESTIMATE, estimate)):
        state.ingest([received(topic, message, NS_PER_S)])
    said = shown(state)
    assert said["vehicles"]["drone_1"]["at"] == said["setpoints"]["drone_1"]["at"] == said["estimate"]["at"] == 1000.0


def test_a_console_that_saw_no_take_off_knows_a_least_time_in_the_air() -> None:
    state, told = ConsoleState(Cast(), 0), []
    flying, landed = m.FlightState.FLYING, m.FlightState.LANDED
    flights = [("drone_1", flying), ("drone_2", landed), ("drone_2", flying), ("drone_1", landed)]
    flights += [("drone_2", landed), ("drone_1", flying)]
    for name, flight in flights:
        status = m.VehicleStatus(header=header(name, NS_PER_S), flight_state=flight, mode="TRACK", battery=0.5)
        state.ingest([received(t.VEHICLE_STATUS, status)])
        told.append(shown(state)["flight"]["or_longer"])
    assert told == [True, True, True, True, False, False]


def test_the_time_in_the_air_goes_on_while_a_drone_is_not_heard() -> None:
    state, board = ConsoleState(Cast(), 0), Snapshot()
    flying, lost, landed = m.FlightState.FLYING, m.FlightState.LOST, m.FlightState.LANDED
    shown, down = [], {0: "LANDED", 4: "LANDED", 5: "LANDED"}
    for turn, flight in enumerate((lost, flying, lost, flying, landed, lost, lost)):
        head = header("drone_1", (turn + 1) * NS_PER_S)
        status = m.VehicleStatus(header=head, flight_state=flight, mode=down.get(turn, "TRACK"), battery=0.5)
        state.ingest([received(t.VEHICLE_STATUS, status)])
        board.begin()
        state.put_often(board, NS_PER_S)
        shown.append(json.loads(board.since(-1))["flight"]["airborne_since_ms"])
    assert shown == [None, 2000.0, 2000.0, 2000.0, None, None, 7000.0]
