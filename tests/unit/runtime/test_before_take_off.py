"""Take-off despite a MUST finding: refused, unless a person insists, which is recorded."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import (
    AckStage,
    CameraStatus,
    Command,
    CommandAck,
    Event,
    FlightState,
    Header,
    Preflight,
    RelativeObservation,
    VehicleStatus,
    Verb,
)
from groundstation.bus.topics import CAMERA_STATUS, COMMAND, COMMAND_ACK, EVENT, OBSERVATION, PREFLIGHT, VEHICLE_STATUS
from groundstation.doctor.finding import Finding, Level
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import MotionCapture, Volume
from groundstation.field.targets import TargetOdometry
from groundstation.flight.flight_plan import plan_of
from groundstation.flight.looking import Looking
from groundstation.preflight.stand import marker_centres, stand_of
from groundstation.runtime.before_take_off import BeforeTakeOff
from groundstation.runtime.operator import Operator
from groundstation.runtime.take_off import TakeOffLimits
from groundstation.runtime.team import TeamPhase
from groundstation.settings.load import load_field

MS = 1_000_000


def status_of(header: Header, *, connected: bool = True) -> CameraStatus:
    return CameraStatus(
        header=header, connected=connected, fps=15.0, age_ms=150.0, frames=99, skipped=0, detections=99
    )  # fmt: skip


class Lab:
    """Two drones on their pads and a ceiling camera; higher_m: its height above the field's value."""

    def __init__(self, field: ResolvedField, higher_m: float = 0.0) -> None:
        exchange = MemoryExchange()
        self.field, self.higher_m, self.now_ns = field, higher_m, 10**12
        self.bus = MemoryBus(exchange, "lab", "supervisor")
        self.page = MemoryBus(exchange, "lab", "console")
        self.devices = MemoryBus(exchange, "lab", "devices")
        self.heard = self.page.subscribe([EVENT, COMMAND_ACK, COMMAND])
        self.said: list[str] = []
        self.checks = BeforeTakeOff(self.bus, field)
        drones = tuple(field.drones)
        self.operator = Operator(self.bus, drones, {}, TakeOffLimits(), self.said.append, self.checks)
        self.states, self.dark = dict.fromkeys(drones, FlightState.LANDED), False

    def turn(self, times: int = 12) -> None:
        for _ in range(times):
            self.now_ns += 66 * MS
            self._speak()
            self.operator.step(self.now_ns)

    def _speak(self) -> None:
        stand = stand_of(self.field)
        camera = stand.cameras["ceiling"]
        for name, state in self.states.items():
            header = self.devices.header(name)
            status = VehicleStatus(header=header, flight_state=state, mode="LANDED", battery=0.9, rate_hz=200.0)
            self.devices.publish(VEHICLE_STATUS, status)
            pad = stand.pads[name]
            for system in self.field.motion_capture:
                self._see(system, name, (*pad.place_m, pad.height_m), pad.yaw_rad)
            if self.dark:
                continue
            centre = marker_centres([pad], np.zeros((1, 2)), np.zeros(1), np.zeros(1))[0] - camera.position_m
            x, y, z = (camera.rotation.T @ centre).tolist()
            self._see("ceiling", name, (x, y, z + self.higher_m), pad.yaw_rad)
        for name in (*self.field.calibrations, *self.field.motion_capture):
            self.devices.publish(CAMERA_STATUS, status_of(self.devices.header(name)))

    def _see(self, sensor: str, name: str, position_m: tuple[float, float, float], yaw_rad: float) -> None:
        observation = RelativeObservation(
            header=self.devices.header(sensor),
            observer=sensor,
            subject=name,
            camera=sensor,
            position_m=position_m,
            yaw_rad=yaw_rad,
            covariance=tuple(1e-4 if i % 5 == 0 else 0.0 for i in range(16)),
        )
        self.devices.publish(OBSERVATION, observation)

    def ask(self, *, anyway: bool = False, drones: tuple[str, ...] = ()) -> CommandAck:
        header = Header(self.now_ns, self.page.header("operator").clock, "operator", "console", 1)
        command = Command(
            header=header,
            id=f"c{self.now_ns}",
            verb=Verb.TAKEOFF,
            scope=("operator", *drones),
            issuer="console",
            run=self.bus.run,
            anyway=anyway,
        )
        self.page.publish(COMMAND, command)
        self.turn(1)
        self.news = [received.message for received in self.heard.drain()]
        return [one for one in self.news if isinstance(one, CommandAck) and one.command_id == command.id][-1]

    @property
    def events(self) -> list[Event]:
        return [one for one in self.news if isinstance(one, Event)]


def test_a_well_team_takes_off(lab_field: ResolvedField) -> None:
    lab = Lab(lab_field)
    lab.turn()
    assert lab.checks.complete(lab.now_ns)
    assert lab.ask().stage is AckStage.ACCEPTED
    assert lab.operator.phase is TeamPhase.TAKING_OFF


def test_an_open_must_refuses_the_take_off_with_cause_and_remedy(lab_field: ResolvedField) -> None:
    lab = Lab(lab_field, higher_m=0.3)
    lab.turn()
    answer = lab.ask()
    assert answer.stage is AckStage.REFUSED and lab.operator.phase is TeamPhase.GROUND
    assert "ceiling" in answer.reason and "cameras.ceiling.position_m" in answer.reason
    assert "groundstation takeoff --anyway" in answer.reason
    lab.operator.take_off(lab.now_ns)
    assert lab.operator.phase is TeamPhase.GROUND and lab.said[-1].startswith("TAKE-OFF REFUSED: pads:")


def test_a_take_off_by_override_is_recorded_with_its_issuer(lab_field: ResolvedField) -> None:
    lab = Lab(lab_field, higher_m=0.3)
    lab.turn()
    assert lab.ask(anyway=True).stage is AckStage.ACCEPTED
    assert lab.operator.phase is TeamPhase.TAKING_OFF
    (override,) = [event for event in lab.events if "although it must not" in event.text]
    assert override.text.startswith("console takes off") and "ceiling" in override.text


def test_the_list_is_told_again_while_nobody_flies(lab_field: ResolvedField) -> None:
    lab = Lab(lab_field, higher_m=0.3)
    lists = lab.page.subscribe([PREFLIGHT])
    lab.turn(60)
    assert lists.drain() == [], "what is not all seen yet is no list"
    lab.checks.publish(lab.checks.findings(lab.now_ns), lab.now_ns)
    lab.turn(100)  # 6.6 s
    told = [received.message for received in lists.drain()]
    assert len(told) == 3
    assert isinstance(told[0], Preflight) and told[0].findings == told[-1].findings  # type: ignore[union-attr]
    assert [one.level for one in told[0].findings[:2]] == ["MUST", "OK"] and told[0].findings[0].remedy
    lab.states = dict.fromkeys(lab.states, FlightState.TAKING_OFF)
    lab.turn(100)
    assert lists.drain() == []


def test_drones_that_flew_in_this_run_may_stand_anywhere(lab_field: ResolvedField) -> None:
    lab = Lab(lab_field, higher_m=0.3)
    lab.turn()
    lab.states = dict.fromkeys(lab.states, FlightState.HOVERING)
    lab.turn()
    lab.states = dict.fromkeys(lab.states, FlightState.LANDED)
    lab.turn()
    assert lab.checks.forbids(lab.now_ns, ()) == []


@pytest.mark.parametrize("flies_on", [False, True])
def test_before_a_second_take_off_somebody_must_be_seen(lab_field: ResolvedField, flies_on: bool) -> None:
    """A camera was turned away after the landing; while one still flies, that says nothing."""
    lab = Lab(lab_field)
    lab.turn()
    lab.states = dict.fromkeys(lab.states, FlightState.HOVERING)
    lab.turn()
    assert lab.checks.forbids(lab.now_ns, ()) == [], "nobody stands"
    lab.states = dict.fromkeys(lab.states, FlightState.LANDED)
    if flies_on:
        lab.states["drone_1"] = FlightState.HOVERING
    lab.dark = True
    lab.turn()
    found = [one for one in lab.checks.findings(lab.now_ns) if one.level is not Level.OK]
    assert [one.level for one in found] == [Level.SHOULD if flies_on else Level.MUST]
    assert "no fixed camera sees" in found[0].found


def test_a_look_waits_for_a_camera_that_is_slower_than_a_motion_capture(lab_field: ResolvedField) -> None:
    box = Volume(x_m=(-3.0, 3.0), y_m=(-3.0, 3.0), z_m=(-3.0, 3.0))
    capture = MotionCapture(source="natnet://10.0.0.2", volume_m=box)
    lab = Lab(msgspec.structs.replace(lab_field, motion_capture={"mocap": capture}))
    lab.dark = True
    lab.turn(8)
    assert not lab.checks.complete(lab.now_ns), "poses of all drones are there, pictures are not"
    lab.dark = False
    lab.turn()
    assert lab.checks.complete(lab.now_ns)
    assert all(one.level is Level.OK for one in lab.checks.findings(lab.now_ns))


def test_a_look_waits_for_word_of_a_targets_odometry(lab_field: ResolvedField) -> None:
    assert lab_field.target is not None
    target = msgspec.structs.replace(lab_field.target, odometry=TargetOdometry(source="ros2://10.0.0.9/odom"))
    lab = Lab(msgspec.structs.replace(lab_field, target=target))
    (name,) = lab.field.reporting
    for connected in (False, True):
        lab.turn()
        assert not lab.checks.complete(lab.now_ns)
        lab.devices.publish(CAMERA_STATUS, status_of(lab.devices.header(name), connected=connected))
    lab.turn(1)
    assert lab.checks.complete(lab.now_ns)


def test_a_look_tells_operator_and_bus_what_must_be_mended(lab_field: ResolvedField) -> None:
    lab = Lab(lab_field, higher_m=0.3)
    looking = Looking(lab.checks, lab.field.drones, lab.now_ns)
    assert not looking.finished(lab.now_ns), "nothing was seen yet"
    lab.turn()
    assert looking.finished(lab.now_ns) and looking.forbidden
    told = list(looking.report(whole=False))
    assert told[0].startswith("MUST") and told[-1] == "before take-off: 1 must be mended"
    lab.turn(1)
    events = [r.message for r in lab.heard.drain() if isinstance(r.message, Event)]
    assert [event.severity for event in events] == ["ERROR"] and events[0].remedy


def test_a_look_ends_where_nothing_arrives(lab_field: ResolvedField) -> None:
    checks = BeforeTakeOff(MemoryBus(MemoryExchange(), "lab", "supervisor"), lab_field)
    looking = Looking(checks, lab_field.drones, 0)
    assert not looking.finished(1000 * MS)
    assert looking.finished(9000 * MS)
    told = "\n".join(looking.report(whole=True))
    assert "no sensor fixed in the world sends anything" in told and "nothing is heard of it" in told
    assert looking.nobody and told.endswith("before take-off: 2 must be mended; nobody would take off")


def test_cautions_of_the_field_file_are_findings_that_forbid_nothing(lab_field: ResolvedField) -> None:
    path = Path(__file__).parents[3] / "config" / "lab.yaml"
    foolish = load_field(path, ("types.ardrone_2.camera.tilt_down_deg=-45",))
    lab = Lab(lab_field)
    lab.checks = BeforeTakeOff(lab.bus, lab_field, plan_of(foolish, None, asks=False).cautions)
    told = [one for one in lab.checks.findings(lab.now_ns) if one.subject.endswith("camera.tilt_down_deg")]
    assert [one.level for one in told] == [Level.SHOULD] * 2 and "seen from above only" in told[0].found


@pytest.mark.parametrize("silent", [("drone_2",), ("drone_1", "drone_2")])
def test_a_look_tells_who_would_be_left_out(lab_field: ResolvedField, silent: tuple[str, ...]) -> None:
    lab = Lab(lab_field)
    lab.states |= dict.fromkeys(silent, FlightState.UNKNOWN)
    looking = Looking(lab.checks, lab_field.drones, lab.now_ns)
    lab.turn()
    assert looking.finished(lab.now_ns) and not looking.forbidden
    who = "drone_2 would be left out" if len(silent) == 1 else "nobody would take off"
    assert list(looking.report(whole=False))[-1] == f"before take-off: nothing must be mended; {who}"
    assert looking.nobody is (len(silent) == 2)
    lab.states = dict.fromkeys(lab.states, FlightState.LANDED)
    lab.turn()
    said = [looking.told_anew(lab.now_ns + second * 1000 * MS) for second in range(6)]
    assert [text for text in said if text] == ["before take-off: nobody would be left out any more"]
    assert not said[1], "it is told once it lasts"


@pytest.mark.parametrize(("battery", "level"), [(0.9, None), (0.3, Level.SHOULD), (0.17, Level.MUST)])
def test_a_battery_is_judged_by_where_it_lands(lab_field: ResolvedField, battery: float, level: Level | None) -> None:
    lab = Lab(lab_field)
    lab.turn()
    header = lab.devices.header("drone_1")
    status = VehicleStatus(
        header=header, flight_state=FlightState.LANDED, mode="LANDED", battery=battery, rate_hz=200.0
    )
    lab.devices.publish(VEHICLE_STATUS, status)
    lab.checks.update(lab.now_ns)
    found: list[Finding] = [one for one in lab.checks.findings(lab.now_ns) if one.level is not Level.OK]
    assert [one.level for one in found] == ([] if level is None else [level])


def test_the_last_status_of_a_silent_driver_is_no_longer_valid(lab_field: ResolvedField) -> None:
    lab = Lab(lab_field)
    lab.turn()
    assert all(one.level is Level.OK for one in lab.checks.findings(lab.now_ns))
    lab.now_ns += 4000 * MS
    lab.checks.update(lab.now_ns)
    found = {one.subject: one for one in lab.checks.findings(lab.now_ns) if one.level is not Level.OK}
    assert found["cameras"].level is Level.MUST
    assert found["drone_1"].found == "nothing is heard of it" and found["drone_1"].remedy
