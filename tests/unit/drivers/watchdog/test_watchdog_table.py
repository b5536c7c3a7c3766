"""The whole state table of the watchdog: every mode under every input, as tables and as invariants."""

import itertools
import random

import pytest

from drivers.failsafe_table import Condition
from drivers.watchdog import Watchdog
from drivers.watchdog_types import FREE, Ack, Action, DriverMode, Upstream, VehicleView, WatchdogLimits
from groundstation.bus.messages import AIRBORNE, AckStage, Command, FlightState, Header, Lease, VelocitySetpoint, Verb

LASTING = (
    Condition.SUPERVISOR_DEAD, Condition.SUPERVISOR_SILENT, Condition.TELEMETRY_SILENT, Condition.BATTERY_LOW,
)  # fmt: skip
S = 1_000_000_000
NOW = 1000 * S
HEADER = Header(NOW, "clock", "drone_1", "tester", 5)
OLD_S = (0.1, 0.6, 1.5, 4.0)
STATES = tuple(FlightState)
UPSTREAMS = {
    "up": Upstream(),
    "frozen": Upstream(supervisor_fresh=False),
    "dead": Upstream(supervisor_alive=False),
    "stop": Upstream(stop_requested=True),
}
SETPOINTS = ("none", "live", "expired", "foreign", "unconverged")
SHORT = {
    Action.WAIT: "wait", Action.IDLE: "idle", Action.TAKE_OFF: "takeoff", Action.FLY: "fly", Action.HOVER: "hover",
    Action.LAND: "land", Action.CUT: "cut",
}  # fmt: skip


def setpoint(epoch=1, converged=True, seq=5, stamp=NOW):
    header = Header(stamp, "clock", "drone_1", "tracker", seq)
    return VelocitySetpoint(
        header=header,
        velocity_m_s=(1.0, 0.0, 0.0),
        yaw_rate_rad_s=0.0,
        lifetime_ms=300,
        epoch=epoch,
        converged=converged,
    )


def watchdog_in(mode, setpoints="live", lease=True, aged_s=0.1):
    """Return a watchdog in a mode, entered `aged_s` ago, with everything else as in its arguments."""
    dog = Watchdog(WatchdogLimits(), "clock")
    dog.mode, dog.reason = mode, "test"
    dog._entered_ns = dog._take_off_ended_ns = NOW - int(aged_s * S)
    dog._last_step_ns = NOW - S // 30
    dog._brake_until_ns = 0
    past = NOW - int(aged_s * S)
    if setpoints == "live":
        dog.accept_setpoint(NOW - 1, setpoint(stamp=NOW - 1))
    elif setpoints == "unconverged":
        dog.accept_setpoint(NOW - 1, setpoint(stamp=NOW - 1, converged=False))
    elif setpoints == "expired":
        dog.accept_setpoint(past - S, setpoint(stamp=past - S))
    elif setpoints == "foreign":
        dog.accept_setpoint(past - S, setpoint(stamp=past - S))
        dog.accept_setpoint(NOW - 1, setpoint(epoch=2, stamp=NOW - 1))
    if lease:
        dog.accept_lease(NOW - 1, Lease(header=HEADER, holder="op", expires_ns=NOW + S))
    for condition in LASTING:
        dog.evidence.charged_s[condition] = aged_s
    return dog


def command(verb):
    return Command(header=HEADER, id="c", verb=verb, scope=(), issuer="op", expires_ns=NOW + S)


def view(state, fresh=True, battery=0.9):
    return VehicleView(state, fresh, battery)


def step(dog, vehicle, upstream=UPSTREAMS["up"]):
    return dog.step(NOW, vehicle, upstream)


VEHICLE_TABLE = """
            UNKNOWN    LANDED     TAKING_OFF FLYING     HOVERING   LANDING    EMERGENCY  LOST
CONNECTING  CONNECTING LANDED     LANDING    LANDING    LANDING    LANDING    LANDED     CONNECTING
            wait       idle       hover      hover      hover      hover      idle       wait
LANDED      LANDED     LANDED     LANDING    LANDING    LANDING    LANDING    LANDED     LANDED
            idle       idle       land       land       land       land       idle       idle
TAKING_OFF  TAKING_OFF TAKING_OFF TAKING_OFF HOVER      HOVER      LANDING    CUT        TAKING_OFF
            takeoff    takeoff    takeoff    hover      hover      land       cut        takeoff
HOVER       HOVER      LANDED     HOVER      HOVER      HOVER      LANDING    CUT        HOVER
            hover      land       hover      hover      hover      land       cut        hover
TRACK       TRACK      LANDED     TRACK      TRACK      TRACK      LANDING    CUT        TRACK
            fly        land       fly        fly        fly        land       cut        fly
HOLD        HOLD       LANDED     HOLD       HOLD       HOLD       LANDING    CUT        HOLD
            hover      land       hover      hover      hover      land       cut        hover
LANDING     LANDING    LANDED     LANDING    LANDING    LANDING    LANDING    CUT        LANDING
            land       idle       land       land       land       land       cut        land
CUT         CUT        CUT        CUT        CUT        CUT        CUT        CUT        CUT
            cut        cut        cut        cut        cut        cut        cut        cut
"""


def test_mode_and_action_by_what_the_vehicle_says():
    """All senders are alive, a setpoint is live: rows are modes, columns the vehicle's state."""
    lines = [" " * 12 + " ".join(f"{state:<10}" for state in STATES)]
    for mode in DriverMode:
        decisions = [step(watchdog_in(mode), view(state)) for state in STATES]
        lines.append(f"{mode:<12}" + " ".join(f"{decision.mode:<10}" for decision in decisions))
        lines.append(" " * 12 + " ".join(f"{SHORT[decision.action]:<10}" for decision in decisions))
    assert [line.rstrip() for line in lines] == VEHICLE_TABLE.strip("\n").split("\n")


COMMAND_TABLE = """
            TAKEOFF    TRACK      HOLD       RESUME     LAND       CUT_MOTORS
CONNECTING  refused    refused    CONNECTING refused    CONNECTING CUT
LANDED      TAKING_OFF refused    LANDED     refused    LANDED     CUT
TAKING_OFF  refused    refused    HOLD       refused    LANDING    CUT
HOVER       refused    TRACK      HOLD       TRACK      LANDING    CUT
TRACK       refused    TRACK      HOLD       TRACK      LANDING    CUT
HOLD        refused    TRACK      HOLD       TRACK      LANDING    CUT
LANDING     refused    refused    refused    refused    LANDING    CUT
CUT         TAKING_OFF refused    refused    refused    refused    CUT
"""


def test_mode_by_command():
    """With a live lease and a vehicle state that fits the mode."""
    says = {
        DriverMode.LANDED: FlightState.LANDED,
        DriverMode.CUT: FlightState.EMERGENCY,
        DriverMode.CONNECTING: FlightState.UNKNOWN,
    }
    lines = [" " * 12 + " ".join(f"{verb:<10}" for verb in Verb)]
    for mode in DriverMode:
        cells = []
        for verb in Verb:
            dog = watchdog_in(mode)
            dog.see(view(says.get(mode, FlightState.TAKING_OFF)), UPSTREAMS["up"])
            ack = dog.accept_command(NOW, command(verb))[-1]
            cells.append("refused" if ack.stage is AckStage.REFUSED else str(dog.mode))
        lines.append(f"{mode:<12}" + " ".join(f"{cell:<10}" for cell in cells))
    assert [line.rstrip() for line in lines] == COMMAND_TABLE.strip("\n").split("\n")


SILENCE_TABLE = """
                   0.1 s      0.6 s      1.5 s      4.0 s
telemetry          hover      hover      hover      land
frozen             hover      hover      hover      land
dead               hover      hover      land       land
stop               land       land       land       land
battery            fly        fly        fly        land
expired            hover      hover      hover      land
foreign            hover      hover      hover      land
"""


def test_action_in_track_by_how_long_something_is_missing():
    """One thing fails, everything else is in order: rows are the failing thing, columns the duration."""
    lines = [" " * 19 + " ".join(f"{f'{age} s':<10}" for age in OLD_S)]
    for what in ("telemetry", *list(UPSTREAMS)[1:], "battery", "expired", "foreign"):
        cells = []
        for age in OLD_S:
            dog = watchdog_in(DriverMode.TRACK, what if what in SETPOINTS else "live", aged_s=age)
            if what in SETPOINTS:
                dog.gate.last_heard_ns = NOW - int(age * S)
            vehicle = view(FlightState.FLYING, fresh=what != "telemetry", battery=0.1 if what == "battery" else 0.9)
            cells.append(SHORT[step(dog, vehicle, UPSTREAMS.get(what, UPSTREAMS["up"])).action])
        lines.append(f"{what:<19}" + " ".join(f"{cell:<10}" for cell in cells))
    assert [line.rstrip() for line in lines] == SILENCE_TABLE.strip("\n").split("\n")


CASES = tuple(
    itertools.product(SETPOINTS, (True, False), (0.1, 4.0), STATES, (True, False), (0.9, 0.1, None), UPSTREAMS)
)


@pytest.mark.parametrize("mode", DriverMode)
def test_invariants_over_every_mode_and_input(mode):
    """Each mode x setpoint x lease x age x vehicle state x freshness x battery x upstream x command, one step each."""
    for setpoints, lease, age, state, fresh, battery, up in CASES:
        for verb in (None, *Verb):
            dog = watchdog_in(mode, setpoints, lease, age)
            vehicle, upstream = view(state, fresh, battery), UPSTREAMS[up]
            dog.see(vehicle, upstream)
            accepted = verb is not None and dog.accept_command(NOW, command(verb))[-1].stage is AckStage.ACCEPTED
            decision = step(dog, vehicle, upstream)
            case = (mode, setpoints, lease, age, state, fresh, battery, up, verb, decision)
            healthy = fresh and up == "up"
            if decision.action is Action.FLY:
                assert setpoints == "live" or (setpoints == "foreign" and verb is Verb.RESUME), case
                assert healthy and state not in (FlightState.LANDED, FlightState.LANDING, FlightState.EMERGENCY), case
                assert mode is DriverMode.TRACK or (mode in FREE and accepted and verb in (Verb.TRACK, Verb.RESUME)), (
                    case
                )
            if decision.action is Action.TAKE_OFF and mode is not DriverMode.TAKING_OFF:
                assert accepted and verb is Verb.TAKEOFF and lease and healthy, case
                assert battery == 0.9 and state in (FlightState.LANDED, FlightState.EMERGENCY), case
            if verb in (Verb.TAKEOFF, Verb.TRACK, Verb.RESUME) and not lease:
                assert not accepted, case
            if verb is Verb.CUT_MOTORS:
                assert accepted and decision.action is Action.CUT, case
            if mode is DriverMode.CUT and not (accepted and verb is Verb.TAKEOFF):
                landed = accepted and verb is Verb.LAND and age == 4.0 and fresh and state in AIRBORNE
                assert decision.action is (Action.LAND if landed else Action.CUT), case
            if decision.action is Action.CUT:
                assert verb is Verb.CUT_MOTORS or mode is DriverMode.CUT or state is FlightState.EMERGENCY, case
            if mode is DriverMode.LANDING and decision.action is not Action.CUT:
                assert decision.action in (Action.LAND, Action.IDLE), case
            if decision.action is Action.IDLE:
                assert not (fresh and state in AIRBORNE), case
            if up == "stop" and mode in (*FREE, DriverMode.TAKING_OFF):
                assert decision.action in (Action.LAND, Action.IDLE, Action.CUT), case


def test_no_sequence_of_inputs_flies_after_land_without_a_take_off():
    """Random walks over inputs with time: the latches and the lease hold whatever the order."""
    for seed in range(60):
        rng = random.Random(seed)
        dog = Watchdog(WatchdogLimits(), "clock")
        now, latched, started, lease_until = NOW, True, False, 0
        for number in range(400):
            now += rng.choice((S // 30, S // 30, S // 30, S // 4, S, 4 * S))
            state, up = rng.choice(STATES[:6] * 4 + STATES), UPSTREAMS[rng.choice(("up",) * 8 + tuple(UPSTREAMS))]
            vehicle = view(state, rng.random() < 0.9, rng.choice((0.9,) * 8 + (0.1, None)))
            header = Header(now, "clock", "drone_1", "tester", number)
            if rng.random() < 0.5:
                dog.accept_lease(now, Lease(header=header, holder="op", expires_ns=now + S))
                lease_until = now + S
            dog.see(vehicle, up)
            verb = rng.choice((None, *Verb))
            if verb is not None:
                order = Command(header=header, id=str(number), verb=verb, scope=(), issuer="op", expires_ns=now + S)
                if dog.accept_command(now, order)[-1].stage is AckStage.ACCEPTED:
                    assert now < lease_until or verb in (Verb.HOLD, Verb.LAND, Verb.CUT_MOTORS)
                    if verb is Verb.TAKEOFF:
                        latched, started = False, True
                    latched = latched or verb in (Verb.LAND, Verb.CUT_MOTORS)
            if rng.random() < 0.8:
                dog.accept_setpoint(now, setpoint(rng.choice((1, 1, 1, 2)), rng.random() < 0.9, number, now))
            decision = dog.step(now, vehicle, up)
            if decision.action in (Action.FLY, Action.TAKE_OFF):
                assert not latched and started
            latched = latched or decision.action in (Action.LAND, Action.CUT)


def test_the_row_that_acted_is_named_until_the_mode_ends(new_bench):
    bench = new_bench().fly()
    assert bench.watchdog.failsafe == ""
    bench.unsound = "its velocity is stuck at 0.00 m/s"
    bench.run(1.2)
    assert (bench.watchdog.mode, bench.watchdog.failsafe) == (DriverMode.HOVER, Condition.SENSORS_WRONG)
    bench.run(2.0)
    assert (bench.watchdog.mode, bench.watchdog.failsafe) == (DriverMode.LANDING, Condition.TELEMETRY_SILENT)
    bench.unsound, bench.state = "", FlightState.LANDED
    bench.step()
    assert (bench.watchdog.mode, bench.watchdog.failsafe) == (DriverMode.LANDED, "")


def test_an_order_is_no_failsafe(new_bench):
    bench = new_bench().fly()
    bench.order(Verb.LAND)
    bench.step()
    assert (bench.watchdog.mode, bench.watchdog.failsafe) == (DriverMode.LANDING, "")


def test_nobody_takes_off_under_somebody(new_bench):
    bench = new_bench()
    bench.near = "drone_2 flies 0.2 m from its pad, at least 0.6 m needed"
    bench.see()
    assert bench.order(Verb.TAKEOFF) == Ack("c0", Verb.TAKEOFF, AckStage.REFUSED, bench.near)
    bench.near = ""
    bench.see()
    assert bench.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED
