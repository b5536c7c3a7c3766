"""The choice of brake for an AR.Drone: the firmware's hold by optical flow, or the driver's braking."""

import pytest

from drivers.ardrone.attitude_control import AttitudeControl, MotionReport
from drivers.ardrone.settings import ArDroneLimits
from drivers.ardrone.velocity_loop import AttitudeRequest, VelocityLoop
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision

TURN_NS = 25_000_000
SOUND = MotionReport(
    fresh=True, told=True, repeats=False, able=True, blind=False, flowless=False,
    velocity_m_s=(0.4, 0.0, 0.0), force_m_s2=(0.0, 0.0), height_m=1.2,
)  # fmt: skip
BLIND = SOUND._replace(repeats=True, blind=True)
FLOWLESS = BLIND._replace(flowless=True, velocity_m_s=(0.0, 0.0, 0.0))
SILENT = SOUND._replace(fresh=False, told=False, able=False)


def decision(action: Action, **more: object) -> WatchdogDecision:
    return WatchdogDecision(DriverMode.TRACK, action, **more)  # type: ignore[arg-type]


class Turns:
    """Turns of the sender, one after the other."""

    def __init__(self) -> None:
        self.control, self.now_ns = AttitudeControl(ArDroneLimits()), 0

    def __call__(self, action: Action, report: MotionReport, seconds: float = 0.1, **more: object) -> AttitudeRequest:
        for _ in range(round(seconds * 1e9 / TURN_NS)):
            self.now_ns += TURN_NS
            asked = self.control.step(self.now_ns, decision(action, **more), report)
        return asked


@pytest.fixture
def turns() -> Turns:
    turns = Turns()
    turns(Action.FLY, SOUND, 1.0, velocity_m_s=(0.4, 0.0, 0.0))
    return turns


@pytest.mark.parametrize("report", [SOUND, SILENT])
def test_one_that_sees_the_floor_or_was_never_blind_holds_its_place_by_itself(turns, report) -> None:
    assert turns(Action.HOVER, report).hover


def test_a_blind_one_is_braked_and_for_three_seconds_after_it_fell_silent(turns) -> None:
    assert not turns(Action.HOVER, BLIND).hover
    assert not turns(Action.HOVER, SILENT, 2.8).hover
    assert turns(Action.HOVER, SILENT, 0.4).hover


def test_one_that_sees_no_floor_sinks_under_the_drivers_braking(turns) -> None:
    asked = turns(Action.LAND, FLOWLESS)
    assert turns.control.sinks and not asked.hover and asked.climb_m_s < 0.0
    turns(Action.LAND, SOUND)
    assert not turns.control.sinks  # its firmware lands it


def test_a_silent_one_that_cameras_see_drift_is_braked(turns) -> None:
    assert turns(Action.HOVER, SILENT, 1.2, seen_m_s=(0.3, 0.0)).hover
    asked = turns(Action.HOVER, SILENT, 0.3, seen_m_s=(0.3, 0.0))
    assert not asked.hover and asked.pitch_rad < 0.0


WRONG = SOUND._replace(velocity_m_s=(-1.5, 0.0, 0.0))
STILL = SOUND._replace(velocity_m_s=(0.01, 0.02, 0.0))


def test_a_velocity_that_contradicts_what_was_asked_for_is_doubted_until_it_lands(turns) -> None:
    turns(Action.FLY, WRONG, 3.0, velocity_m_s=(0.4, 0.0, 0.0))
    assert turns.control.doubted
    assert turns(Action.HOVER, SOUND, 3.0).hover
    assert turns.control.doubted
    turns(Action.IDLE, SOUND)
    assert not turns.control.doubted


@pytest.mark.parametrize(
    "before", [[], [(Action.HOVER, SOUND, 0.2)], [(Action.FLY, SOUND._replace(obeys=False), 0.5)]],
    ids=["at once", "after a moment of hover", "deaf besides"],
)  # fmt: skip
def test_one_that_flew_its_last_tilt_on_while_its_link_was_silent_contradicts_nothing(turns, before) -> None:
    turns(Action.HOVER, SILENT, 0.7)
    for action, report, seconds in before:
        turns(action, report._replace(velocity_m_s=(0.6, 0.0, 0.0)), seconds, velocity_m_s=(-0.3, 0.0, 0.0))
    for speed_m_s in (0.6, 0.7, 0.7, 0.65, 0.55, 0.45, 0.35, 0.25, 0.15):
        turns(Action.FLY, SOUND._replace(velocity_m_s=(speed_m_s, 0.0, 0.0)), velocity_m_s=(-0.3, 0.0, 0.0))
    assert turns.control.doubted == ""


def test_it_is_believed_again_once_cameras_have_seen_the_drone_stand_as_it_reports(turns) -> None:
    turns(Action.FLY, WRONG, 3.0, velocity_m_s=(0.4, 0.0, 0.0))
    turns(Action.HOVER, STILL, 2.0, seen_m_s=(0.02, 0.0))
    assert not turns.control.doubted


def test_a_doubted_one_that_cameras_see_drift_is_braked(turns) -> None:
    turns(Action.FLY, WRONG, 3.0, velocity_m_s=(0.4, 0.0, 0.0))
    asked = turns(Action.HOVER, SOUND, 1.6, seen_m_s=(0.4, 0.0))
    assert turns.control.doubted and not asked.hover and asked.pitch_rad < 0.0


def test_one_that_reports_to_stand_though_sent_on_is_blind_and_braked_and_sinks(turns) -> None:
    turns(Action.FLY, STILL, 1.5, velocity_m_s=(0.3, 0.0, 0.0))
    assert turns.control.blind
    assert not turns(Action.HOVER, STILL).hover
    turns(Action.LAND, STILL)
    assert turns.control.sinks


def test_one_that_hears_no_command_is_not_doubted_for_not_obeying_and_is_to_hold_its_place(turns) -> None:
    deaf = STILL._replace(obeys=False)
    assert turns(Action.FLY, deaf, 3.0, velocity_m_s=(0.4, 0.0, 0.0)).hover
    turns(Action.FLY, STILL, 0.2, velocity_m_s=(0.4, 0.0, 0.0))
    assert not turns.control.doubted and not turns.control.blind


def test_one_that_cameras_see_move_though_it_reports_to_stand_is_blind_and_braked(turns) -> None:
    asked = turns(Action.HOVER, STILL, 2.0, seen_m_s=(0.3, 0.0))
    assert turns.control.blind and not asked.hover and asked.pitch_rad < 0.0


@pytest.mark.parametrize(("wanted_m_s", "seconds", "blind"), [(0.2, 0.9, True), (0.05, 0.7, False)])
def test_cameras_need_less_time_where_commands_agree_with_them(wanted_m_s, seconds, blind) -> None:
    turns, wanted = Turns(), (wanted_m_s, 0.0, 0.0)
    turns(Action.FLY, SOUND._replace(velocity_m_s=wanted), 2.0, velocity_m_s=wanted)
    turns(Action.FLY, STILL, seconds, velocity_m_s=wanted, seen_m_s=(0.2, 0.0))
    assert turns.control.blind is blind


def test_one_that_cameras_find_blind_in_flight_is_braked_from_the_speed_that_they_saw() -> None:
    turns = Turns()
    turns(Action.FLY, SOUND._replace(velocity_m_s=(0.2, 0.0, 0.0)), 2.0, velocity_m_s=(0.2, 0.0, 0.0))
    while not turns.control.blind:
        turns(Action.FLY, STILL, 0.025, velocity_m_s=(0.2, 0.0, 0.0), seen_m_s=(0.25, 0.0))
    braking = turns(Action.HOVER, STILL, 0.1, seen_m_s=(0.25, 0.0)).pitch_rad
    assert braking < -0.03


TOLD = SOUND._replace(velocity_m_s=(0.4, 0.0, 0.0))


@pytest.mark.parametrize(
    ("seen_m_s", "seconds", "blind"), [(0.15, 1.5, True), (0.15, 0.7, False), (0.25, 3.0, False)], ids=str
)
def test_one_whose_velocity_cameras_contradict_in_flight_is_blind(seen_m_s, seconds, blind) -> None:
    turns, asked = Turns(), (0.4, 0.0, 0.0)
    turns(Action.FLY, TOLD, 2.0, velocity_m_s=asked, seen_m_s=(0.4, 0.0))
    turns(Action.FLY, TOLD, seconds, velocity_m_s=asked, seen_m_s=(seen_m_s, 0.0))
    assert turns.control.blind is blind
    assert bool(turns.control.doubted) is blind


def test_cameras_need_less_time_where_commands_contradict_the_velocity_too() -> None:
    turns, asked = Turns(), (0.4, 0.0, 0.0)
    turns(Action.FLY, TOLD, 2.0, velocity_m_s=asked, seen_m_s=(0.4, 0.0))
    left_m_s = 0.0
    while not turns.control.doubted:
        left_m_s += 0.01
        wrong = SOUND._replace(velocity_m_s=(0.4, left_m_s, 0.0))
        turns(Action.FLY, wrong, 0.025, velocity_m_s=asked, seen_m_s=(0.4, 0.0))
    turns(Action.HOVER, wrong, 0.45, seen_m_s=(0.4, 0.0))
    assert turns.control.blind


def test_one_that_is_flown_back_to_its_place_is_judged_like_one_that_tracks(turns) -> None:
    """Seed 750009 of the lab field: 0.6 m/s on the way back, by an integral of the tilts."""
    turns(Action.HOVER, TOLD, 1.0, seen_m_s=(0.15, 0.0), back_m_s=(0.3, 0.0, 0.0))
    assert turns.control.blind


def test_a_fast_one_may_be_wrong_by_its_scale(turns) -> None:
    fast = SOUND._replace(velocity_m_s=(1.25, 0.0, 0.0))
    turns(Action.FLY, fast, 4.0, velocity_m_s=(1.25, 0.0, 0.0), seen_m_s=(1.0, 0.0))
    assert not turns.control.blind


def test_one_found_blind_while_it_brakes_is_not_pushed_backwards() -> None:
    """Cameras tell a mean that is half a second old: commands since then have slowed it."""
    loop, tilt, speed, flown = VelocityLoop(ArDroneLimits()), 0.0, 0.0, list[float]()
    for turn in range(240):
        if turn < 140:
            wanted = 0.4 if turn < 120 else 0.0
            asked = loop.step((wanted, 0.0, 0.0), 0.0, (speed if turn < 120 else 0.4, 0.0, 0.0), 0.025)
        else:
            asked = loop.brake(0.025)
        if turn == 139:
            loop.recover((sum(flown[-24:]) / 24, 0.0), 0.025)
        tilt += (asked.pitch_rad - tilt) * 0.025 / 0.15
        speed += (9.81 * tilt - 0.15 * speed) * 0.025
        flown.append(speed)
    assert min(flown) > -0.08 and abs(flown[-1]) < 0.08


def test_one_whose_velocity_cameras_confirm_is_neither_doubted_nor_braked(turns) -> None:
    assert turns(Action.HOVER, STILL, 5.0, seen_m_s=(0.08, 0.0)).hover
    assert not turns.control.doubted
