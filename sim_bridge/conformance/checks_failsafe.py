"""Checks of all failsafes, and that nothing but an order moves a stopped vehicle again."""

import re

import numpy as np

from groundstation.bus.messages import AckStage
from groundstation.bus.topics import COMMAND_ACK, EVENT, VEHICLE_STATUS
from sim_bridge.conformance.check import Case, check
from sim_bridge.conformance.motions import brakes, lands, still, stops_without_positions

_REASONED = re.compile(r"\b(HOVER|LANDING): \S")


def _modes(case: Case, mark: str) -> set[str]:
    return {one.message.mode for one in case.record.heard(VEHICLE_STATUS, mark)}


@check("silence")
def silence_brakes(case: Case) -> None:
    """Without setpoints it hovers: 0.3 s later it brakes, after 0.9 s it has lost half of its speed."""
    brakes(case, "silence", 0.95)


@check("silence")
def silence_ends_in_hover(case: Case) -> None:
    """1.3 s after the last setpoint it stands."""
    still(case, "silence", 1.35)


@check("silence")
def moment_of_silence_is_survived(case: Case) -> None:
    """A silence of 0.4 s changes no mode, and setpoints count again at once."""
    assert _modes(case, "after a pause") == {"TRACK"}, f"modes {_modes(case, 'after a pause')}"
    assert case.record.motion("after a pause")[-1].speed > 0.15, "it stands"


@check("silence")
def long_silence_needs_resume(case: Case) -> None:
    """After a longer silence setpoints move nothing until RESUME."""
    still(case, "setpoints without RESUME", 0.2)
    assert _modes(case, "setpoints without RESUME") == {"HOVER"}


@check("silence")
def resume_is_answered(case: Case) -> None:
    """RESUME is RECEIVED, ACCEPTED, and EFFECTIVE once a setpoint is obeyed."""
    stages = case.record.stages("resume after silence", COMMAND_ACK)
    assert stages == [AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE], " ".join(stages)


@check("silence")
def lasting_silence_lands(case: Case) -> None:
    """3 s after the last setpoint it lands."""
    case.record.span("until it lands")
    after = case.record.facts["landing after"]
    assert 2.7 < after < 3.8, f"after {after:.1f} s"


@check("silence")
def landing_is_latched(case: Case) -> None:
    """Setpoints do not stop a landing."""
    lands(case, "landing")
    heights = [one.position[2] for one in case.record.motion("latched")]
    assert max(heights) - heights[0] < 0.15, f"it rose by {max(heights) - heights[0]:.2f} m"


@check("silence")
def landing_refuses_orders(case: Case) -> None:
    """TRACK, RESUME and TAKEOFF during a landing are refused."""
    for command in ("track while landing", "take off while landing", "resume while landing"):
        stages = case.record.stages(command, COMMAND_ACK)
        assert stages == [AckStage.RECEIVED, AckStage.REFUSED], f"{command}: {' '.join(stages)}"


@check("silence")
def landed_stays_down(case: Case) -> None:
    """After a landing by failsafe it stays down while setpoints come."""
    assert not [one for one in case.record.motion("landed", 0.3) if not one.on_ground or one.motors], "it rose"


@check("epochs")
def new_epoch_moves_nothing(case: Case) -> None:
    """Setpoints of a new epoch move nothing before RESUME."""
    still(case, "new epoch without RESUME")


@check("epochs")
def new_epoch_needs_resume(case: Case) -> None:
    """TRACK is refused after a new epoch."""
    stages = case.record.stages("track a new epoch", COMMAND_ACK)
    assert stages == [AckStage.RECEIVED, AckStage.REFUSED], " ".join(stages)


@check("epochs")
def new_epoch_counts_after_resume(case: Case) -> None:
    """RESUME lets the new epoch's setpoints count."""
    assert case.record.motion("new epoch resumed")[-1].speed > 0.2, "it stands"


@check("epochs")
def old_epoch_moves_nothing(case: Case) -> None:
    """Setpoints of an older epoch move nothing."""
    still(case, "old epoch")


@check("epochs")
def old_sequence_moves_nothing(case: Case) -> None:
    """Setpoints with an older sequence number move nothing."""
    still(case, "old sequence")


@check("epochs")
def other_source_moves_nothing(case: Case) -> None:
    """Setpoints from any sender but the tracker move nothing, and are counted."""
    still(case, "other source")
    counted = case.record.last(VEHICLE_STATUS, "epoch far ahead").rejected
    assert counted.get("setpoint_other_source"), f"refused: {counted}"


@check("epochs")
def epoch_far_ahead_moves_nothing(case: Case) -> None:
    """A setpoint of an epoch far ahead does not make the true ones look old."""
    still(case, "epoch far ahead")
    assert _modes(case, "epoch far ahead") == {"TRACK"}, f"{_modes(case, 'epoch far ahead')}"


@check("epochs")
def unconverged_moves_nothing(case: Case) -> None:
    """Setpoints of a tracker whose estimate has not converged move nothing."""
    still(case, "not converged")


@check("epochs")
def stop_in_the_air_lands(case: Case) -> None:
    """SIGTERM in the air lands the vehicle; then the driver ends with exit code 0."""
    lands(case, "stopped in the air")
    assert case.record.exits == [0], f"exit code {case.record.exits}"


@check("killed")
def hover_datagram_stops_it(case: Case) -> None:
    """After kill -9 of its driver the kind's hover datagram stops the vehicle."""
    if case.subject.kind.habits.flies_on_estimate:
        stops_without_positions(case, "told to hover")
    else:
        still(case, "told to hover", 1.8)


@check("killed")
def hover_datagram_keeps_its_height(case: Case) -> None:
    """Meanwhile it keeps its height within 0.4 m."""
    heights = [one.position[2] for one in case.record.motion("told to hover")]
    assert max(heights) - min(heights) < 0.4, f"{min(heights):.2f} to {max(heights):.2f} m"


@check("killed")
def new_life_lands(case: Case) -> None:
    """A driver that starts while the vehicle flies lands it."""
    lands(case, "landing by a new life")


@check("killed")
def new_life_flies_again(case: Case) -> None:
    """After that landing the new life takes off on order."""
    stages = case.record.stages("take off after a new life", COMMAND_ACK)
    assert stages and stages[-1] == AckStage.EFFECTIVE, f"{' '.join(stages)} {case.record.failure}"


@check("killed")
def land_datagram_lands_it(case: Case) -> None:
    """After kill -9 the kind's land datagram alone brings it down, motors off."""
    end = case.record.motion("landed by others")[-1]
    assert end.on_ground and not end.motors, f"it is at {end.position[2]:.2f} m"


@check("orphaned")
def frozen_supervisor_brakes(case: Case) -> None:
    """While the supervisor stands still the vehicle hovers."""
    assert case.record.motion("supervisor frozen")[-1].speed < 0.3, "it flies on"


@check("orphaned")
def supervisor_is_obeyed_again(case: Case) -> None:
    """When the supervisor continues within a second, setpoints count again."""
    assert case.record.motion("supervisor again")[-1].speed > 0.15, "it stands"


@check("orphaned")
def orphan_lands(case: Case) -> None:
    """When the supervisor dies the driver lands the vehicle."""
    lands(case, "orphaned")


@check("orphaned")
def orphan_ends(case: Case) -> None:
    """Then the driver ends by itself."""
    case.record.span("exit of an orphan")
    assert case.record.facts["orphan ended"], "it still runs"


@check("unheard")
def unheard_vehicle_brakes(case: Case) -> None:
    """A vehicle that falls silent is commanded to hover: after 1.2 s it has lost half of its speed."""
    brakes(case, "silent vehicle", 1.2)


@check("unheard")
def pause_of_the_radio_ends_in_a_hover(case: Case) -> None:
    """After a silence of 1.6 s it is commanded to hover until it has been heard for a while."""
    still(case, "heard in time")


@check("unheard")
def pause_of_the_radio_is_survived(case: Case) -> None:
    """Then setpoints count again without an order."""
    assert _modes(case, "goes on") == {"TRACK"}, f"modes {_modes(case, 'goes on')}"
    assert case.record.motion("goes on")[-1].speed > 0.15, "it stands"


@check("unheard")
def unheard_vehicle_is_lost(case: Case) -> None:
    """A vehicle that falls silent is called LOST."""
    said = [one.message.flight_state for one in case.record.heard(VEHICLE_STATUS, "silent vehicle")]
    assert said and said[-1] == "LOST", f"said: {said[-3:]}"


@check("unheard")
def unheard_vehicle_lands(case: Case) -> None:
    """A vehicle that stays silent is landed."""
    lands(case, "landing unheard")


@check("unheard")
def heard_again_it_is_known(case: Case) -> None:
    """When its telemetry returns its state is known again: LANDED."""
    said = case.record.last(VEHICLE_STATUS, "heard again").flight_state
    assert said == "LANDED", f"it is called {said}"


@check("cut")
def cut_stops_the_motors(case: Case) -> None:
    """CUT_MOTORS stops the motors in the air within 0.5 s."""
    begin, _ = case.record.span("fall")
    assert not case.record.at(begin + 500_000_000).motors, "they turn"


@check("cut")
def cut_is_answered(case: Case) -> None:
    """CUT_MOTORS is effective once the motors stand."""
    stages = case.record.stages("cut", COMMAND_ACK)
    assert stages and stages[-1] == AckStage.EFFECTIVE, " ".join(stages)


@check("cut")
def cut_needs_a_new_take_off(case: Case) -> None:
    """After a cut nothing starts the motors but a TAKEOFF, and that does."""
    assert not [one for one in case.record.motion("cut", 0.1) if one.motors], "they turn again"
    stages = case.record.stages("take off after the cut", COMMAND_ACK)
    assert stages and stages[-1] == AckStage.EFFECTIVE, f"{' '.join(stages)} {case.record.failure}"


@check("cut")
def low_battery_lands(case: Case) -> None:
    """A charge below the limit lands it."""
    lands(case, "landing with a low battery")


@check("frozen")
def frozen_telemetry_stops_it(case: Case) -> None:
    """When its reports repeat themselves it is stopped within 2.5 s, and landed."""
    speeds = [one.speed for one in case.record.motion("frozen", 2.5)]
    assert not speeds or float(np.median(speeds[:100])) < 0.25, f"{np.median(speeds[:100]):.2f} m/s"
    lands(case, "landing frozen")


@check("jumping")
def impossible_velocity_stops_it(case: Case) -> None:
    """When it reports a velocity that cannot be true it is stopped and landed."""
    lands(case, "landing jumping")


@check("jumping")
def impossible_velocity_is_not_flown_by(case: Case) -> None:
    """Meanwhile no command makes it faster than one and a half times its limit."""
    speed = max(one.speed for one in case.record.motion("jumping"))
    assert speed < 0.9, f"{speed:.2f} m/s"


@check("jumping")
def operator_is_told_why(case: Case) -> None:
    """An event gives the operator the reason for the landing."""
    texts = [one.message.text for one in case.record.heard(EVENT, "jumping")]
    told = "; ".join(texts) or f"none{case.record.burden}"
    assert any(_REASONED.search(text) for text in texts), f"no event has a reason; events: {told}"
