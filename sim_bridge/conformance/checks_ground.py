"""Checks of a standing vehicle: the start of its driver, its messages, and that nothing lifts it unasked."""

import itertools
import math

from groundstation.bus.messages import AckStage
from groundstation.bus.topics import COMMAND_ACK, EVENT, PROCESS_STATUS, RAW_RX, RAW_TX, VEHICLE_STATUS
from sim_bridge.conformance.check import Case, NotApplicable, check

_STARTED_S = 15.0
_REFUSED = [AckStage.RECEIVED, AckStage.REFUSED]


def _stays(case: Case, mark: str) -> None:
    motion = case.record.motion(mark)
    lifted = [one for one in motion if not one.on_ground or one.motors]
    assert motion and not lifted, f"it did not stay on the ground with motors off while: {mark}"


def _refused(case: Case, command: str) -> None:
    stages = case.record.stages(command, COMMAND_ACK)
    assert stages == _REFUSED, f"answers to {command}: {' '.join(stages) or 'none'}"


@check("stand")
def driver_becomes_ready(case: Case) -> None:
    """The driver says READY within 15 s of its start, and LANDED of a vehicle that stands."""
    begin, end = case.record.span("start")
    assert (end - begin) / 1e9 < _STARTED_S, f"READY after {(end - begin) / 1e9:.1f} s"
    assert not [one for one in case.record.heard(PROCESS_STATUS, "standing") if one.message.state != "READY"]


@check("stand")
def says_that_it_stands(case: Case) -> None:
    """A vehicle that stands is LANDED, all the time."""
    said = {one.message.flight_state for one in case.record.heard(VEHICLE_STATUS, "standing")}
    assert said == {"LANDED"}, f"said: {', '.join(sorted(said)) or 'nothing'}"


@check("stand")
def status_comes_at_4_hz(case: Case) -> None:
    """Status comes at 4 Hz at least."""
    rate = len(case.record.heard(VEHICLE_STATUS, "standing")) / 2.0
    assert rate >= 4.0, f"{rate:.1f} Hz"


@check("stand")
def status_tells_the_charge(case: Case) -> None:
    """The charge is reported as a share, within 3 % of the true one."""
    told = case.record.last(VEHICLE_STATUS, "standing").battery
    true = case.record.motion("standing")[-1].battery
    assert told is not None and abs(told - true) < 0.03, f"told {told}, true {true:.2f}"


@check("stand")
def status_tells_the_rate(case: Case) -> None:
    """The reported rate of telemetry is finite and above 1 Hz."""
    told = case.record.last(VEHICLE_STATUS, "standing").rate_hz
    assert math.isfinite(told) and told > 1.0, f"{told:.1f} Hz told"


@check("stand")
def start_lifts_nothing(case: Case) -> None:
    """Start and configuration lift nothing and start no motor."""
    _stays(case, "start")
    _stays(case, "standing")


@check("stand")
def take_off_needs_a_lease(case: Case) -> None:
    """TAKEOFF without a live operator lease is refused."""
    _refused(case, "take off without lease")
    _stays(case, "without a lease")


@check("stand")
def take_off_needs_the_holder(case: Case) -> None:
    """TAKEOFF from any sender but the lease's holder is refused."""
    _refused(case, "take off by a stranger")


@check("stand")
def expired_take_off_is_refused(case: Case) -> None:
    """A TAKEOFF that has expired is refused."""
    _refused(case, "expired take off")


@check("stand")
def track_on_the_ground_is_refused(case: Case) -> None:
    """TRACK of a standing vehicle is refused."""
    _refused(case, "track on the ground")


@check("stand")
def orders_to_others_are_not_answered(case: Case) -> None:
    """A command whose scope is another vehicle is neither obeyed nor answered."""
    assert not case.record.stages("take off of another", COMMAND_ACK), "it was answered"
    _stays(case, "refused")


@check("stand")
def hold_and_land_are_answered_on_the_ground(case: Case) -> None:
    """HOLD and LAND of a standing vehicle are accepted and effective at once."""
    for command in ("hold on the ground", "land on the ground"):
        stages = case.record.stages(command, COMMAND_ACK)
        assert stages == [AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE], f"{command}: {' '.join(stages)}"


@check("stand")
def setpoints_lift_nothing(case: Case) -> None:
    """Setpoints to a standing vehicle start no motor."""
    _stays(case, "setpoints on the ground")


@check("stand")
def hover_datagram_lifts_nothing(case: Case) -> None:
    """The kind's hover datagram, sent to a standing vehicle beside its driver, starts no motor."""
    _stays(case, "told to hover")


@check("stand")
def land_datagram_lifts_nothing(case: Case) -> None:
    """The kind's land datagram, sent to a standing vehicle beside its driver, starts no motor."""
    _stays(case, "told to land")


@check("stand")
def low_battery_refuses_a_start(case: Case) -> None:
    """TAKEOFF with a charge below the limit is refused, and the answer says so."""
    _refused(case, "take off with a low battery")
    _stays(case, "low battery")
    answers = [one.message for one in case.record.heard(COMMAND_ACK)]
    assert "battery" in answers[-1].reason, f"the reason is: {answers[-1].reason}"


@check("stand")
def stop_on_the_ground_ends_the_driver(case: Case) -> None:
    """SIGTERM ends the driver of a standing vehicle within 4 s with exit code 0."""
    case.record.span("low battery")
    assert case.record.exits == [0], f"exit code {case.record.exits}"


@check("stand")
def end_on_the_ground_is_told(case: Case) -> None:
    """The driver ends through `drivers.host`, which calls `child.finish`; otherwise others land its vehicle."""
    case.record.span("low battery")
    assert case.record.facts["finished"], "it ended without child.finish(), as if its vehicle still flew"


@check("stand")
def refusals_are_events(case: Case) -> None:
    """Refusals are reported to the operator as events."""
    texts = [one.message.text for one in case.record.heard(EVENT)]
    assert any("refused" in text for text in texts), f"events: {texts}"


@check("stand")
def datagrams_are_recorded(case: Case) -> None:
    """Datagrams of both directions are in the recording."""
    sent, came = (len(case.record.heard(topic, "standing")) for topic in (RAW_TX, RAW_RX))
    assert came, "nothing that came is recorded"
    assert sent or case.record.heard(RAW_TX), "nothing that was sent is recorded"


@check("damaged")
def damaged_datagrams_end_no_driver(case: Case) -> None:
    """The driver survives thousands of damaged datagrams from its vehicle's own port."""
    case.record.span("damaged")
    sent = case.record.facts["sent damaged"]
    assert case.record.facts["alive"], f"it ended after {sent:.0f}: {case.record.log[-400:]}"
    if not sent:
        raise NotApplicable("the emulator sends no datagrams by sockets of Python")


@check("damaged")
def damaged_datagrams_lift_nothing(case: Case) -> None:
    """Damaged datagrams start no motor."""
    _stays(case, "damaged")


@check("damaged")
def damaged_datagrams_leave_no_trace(case: Case) -> None:
    """After the damage it flies and lands as before."""
    stages = case.record.stages("take off after the damage", COMMAND_ACK)
    assert stages and stages[-1] == AckStage.EFFECTIVE, f"{' '.join(stages) or 'no answer'} {case.record.failure}"
    case.record.span("landing after the damage")
    assert math.isfinite(case.record.facts["landing after the damage"]), case.record.failure


@check("damaged")
def driver_goes_on_speaking_under_damage(case: Case) -> None:
    """Status keeps coming while datagrams are damaged: no pause longer than 1 s."""
    begin, end = case.record.span("damaged")
    times = [begin, *(one.at_ns for one in case.record.heard(VEHICLE_STATUS, "damaged")), end]
    longest = max(later - earlier for earlier, later in itertools.pairwise(times)) / 1e9
    assert longest < 1.0, f"silent for {longest:.1f} s"
