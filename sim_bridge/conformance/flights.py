"""The kit's flights: scripts that produce the situations of the checks. A script judges nothing."""

import signal
import time

from groundstation.bus.messages import Verb
from groundstation.bus.topics import RAW_RX, VEHICLE_STATUS
from sim_bridge.conformance.bench import Bench, FlightFailed
from sim_bridge.conformance.script import SCRIPTS, script
from sim_bridge.conformance.subject import LIMITS, NAME
from sim_bridge.fault_kinds import Fault, FaultKind

SPEED_M_S, CLIMB_M_S, TURN_RAD_S, LEG_S, CLIMB_S = 0.4, 0.25, 0.6, 2.5, 2.0
# Faults of a vehicle's reports begin when it has long been flying; the world's clock starts with the room.
FAULT_S = 22.0
LOW_BATTERY = 0.05
_DAMAGED_S = 6.0

__all__ = ["CLIMB_M_S", "CLIMB_S", "FAULT_S", "LEG_S", "SCRIPTS", "SPEED_M_S", "TURN_RAD_S", "track_ahead"]


@script()
def _stand(bench: Bench) -> None:
    """On the ground: nothing may lift it but a permitted TAKEOFF."""
    bench.connect()
    bench.spend("standing", 2.0)
    bench.up.leases = False
    time.sleep(1.3)
    with bench.mark("without a lease"):
        bench.order("take off without lease", Verb.TAKEOFF)
        time.sleep(0.5)
    bench.up.leases = True
    time.sleep(0.3)
    with bench.mark("refused"):
        bench.order("take off by a stranger", Verb.TAKEOFF, issuer="stranger")
        bench.order("expired take off", Verb.TAKEOFF, lives_s=-1.0)
        bench.order("track on the ground", Verb.TRACK)
        bench.order("take off of another", Verb.TAKEOFF, limit_s=0.6, scope=("somebody",))
        bench.order("hold on the ground", Verb.HOLD)
        bench.order("land on the ground", Verb.LAND)
        bench.fly("setpoints on the ground", (SPEED_M_S, 0.0, 0.0), 0.0, 0.5)
    bench.speak("hover", 1.0)
    bench.speak("land", 0.5)
    bench.room.do(lambda: setattr(bench.room.body, "battery", LOW_BATTERY))
    time.sleep(2.5)
    with bench.mark("low battery"):
        bench.order("take off with a low battery", Verb.TAKEOFF)
        time.sleep(0.5)
    bench.end()


@script()
def _square(bench: Bench) -> None:
    """A whole flight: take-off, a square, up, down, a turn, HOLD, RESUME, LAND, and a second take-off."""
    bench.track()
    bench.spend("still", 1.5)
    for mark, x, y in (("forward", 1, 0), ("left", 0, 1), ("back", -1, 0), ("right", 0, -1)):
        bench.fly(mark, (SPEED_M_S * x, SPEED_M_S * y, 0.0), 0.0, LEG_S)
        time.sleep(1.2)
    bench.fly("up", (0.0, 0.0, CLIMB_M_S), 0.0, CLIMB_S)
    time.sleep(0.8)
    bench.fly("down", (0.0, 0.0, -CLIMB_M_S), 0.0, CLIMB_S)
    time.sleep(0.8)
    bench.fly("turn", (0.0, 0.0, 0.0), TURN_RAD_S, 2.0)
    time.sleep(0.8)
    # A vehicle's forward axis turns with it.
    bench.fly("forward after the turn", (SPEED_M_S, 0.0, 0.0), 0.0, LEG_S)
    time.sleep(0.5)
    bench.fly("too fast", (0.0, -1.5 * LIMITS.max_speed_m_s, 0.0), 0.0, 2.0)
    time.sleep(1.0)
    bench.up.wanted = ((SPEED_M_S, 0.0, 0.0), 0.0)
    time.sleep(0.7)
    bench.order("hold", Verb.HOLD)
    bench.spend("held", 2.0)
    bench.up.wanted = ((0.0, 0.0, 0.0), 0.0)
    bench.begin_tracking("resume", Verb.RESUME)
    time.sleep(0.5)
    repeated = bench.up.order("land", Verb.LAND)
    time.sleep(0.5)
    bench.up.repeat(repeated)
    bench.await_landing("landing")
    bench.spend("landed", 1.5)
    bench.take_off("take off again")
    bench.order("land again", Verb.LAND)
    bench.await_landing("second landing")
    time.sleep(0.5)
    bench.end()


def track_ahead(bench: Bench) -> None:
    """Track, and fly ahead until it is fast."""
    bench.track()
    bench.up.wanted = ((SPEED_M_S, 0.0, 0.0), 0.0)
    time.sleep(1.2)


@script()
def _silence(bench: Bench) -> None:
    """The tracker falls silent in flight: for a moment, for longer, for good."""
    track_ahead(bench)
    bench.up.speaks = False
    bench.spend("a pause", 0.4)
    bench.up.speaks = True
    bench.spend("after a pause", 0.6)
    bench.up.speaks = False
    bench.spend("silence", 1.5)
    bench.up.speaks = True
    bench.spend("setpoints without RESUME", 1.0)
    bench.up.wanted = ((0.0, 0.0, 0.0), 0.0)
    bench.begin_tracking("resume after silence", Verb.RESUME)
    bench.up.speaks = False
    with bench.mark("until it lands"):
        began = time.monotonic()
        bench.wait(lambda: bench.mode("LANDING"), 8.0, must=False)
        bench.record.facts["landing after"] = time.monotonic() - began
    bench.up.speaks, bench.up.wanted = True, ((SPEED_M_S, 0.0, CLIMB_M_S), 0.0)
    with bench.mark("latched"):
        bench.order("track while landing", Verb.TRACK)
        bench.order("take off while landing", Verb.TAKEOFF)
        bench.order("resume while landing", Verb.RESUME)
        bench.await_landing("landing")
    bench.spend("landed", 1.5)
    bench.end()


@script()
def _epochs(bench: Bench) -> None:
    """Setpoints that must not count: old, foreign, unconverged, of a tracker that was started again."""
    bench.track()
    odd = ((SPEED_M_S, 0.0, 0.0), 0.0)
    up = bench.up
    up.epoch = 2  # of a new tracker: from now on that of the first one is old
    up.wanted = odd
    bench.spend("new epoch without RESUME", 1.5)
    bench.order("track a new epoch", Verb.TRACK)
    up.wanted = ((0.0, 0.0, 0.0), 0.0)
    bench.begin_tracking("resume a new epoch", Verb.RESUME)
    bench.fly("new epoch resumed", (SPEED_M_S, 0.0, 0.0), 0.0, 1.5)
    time.sleep(1.2)
    for mark, name, changes, seq in (
        ("old epoch", "kit", {"epoch": 1}, None),
        ("old sequence", "kit", {}, 0),
        ("other source", "stranger", {}, None),
        ("epoch far ahead", "kit", {"epoch": 2_000_000_000}, None),
    ):
        with bench.mark(mark):
            for _ in range(20):
                up.say(name, up.setpoint(up.bus_of(name), velocity_m_s=odd[0], **changes), seq)
                time.sleep(0.05)
    up.wanted, up.converged = odd, False
    bench.spend("not converged", 1.5)
    up.wanted, up.converged = ((0.0, 0.0, 0.0), 0.0), True
    time.sleep(0.3)
    bench.driver.send(signal.SIGTERM)
    bench.await_landing("stopped in the air")
    bench.await_exit(8.0)


@script()
def _killed(bench: Bench) -> None:
    """kill -9 of the driver in flight: others hover for it, a new life lands it; killed again, others land it."""
    track_ahead(bench)
    bench.driver.send(signal.SIGKILL)
    time.sleep(0.1)
    bench.speak("hover", 2.5)
    with bench.mark("new life"):
        bench.start_driver()
        with bench.failsafe() as say:
            for _ in range(100):
                if bench.mode("LANDING") and bench.newest_after_start():
                    break
                say("hover")
                time.sleep(0.1)
        bench.await_landing("landing by a new life")
    bench.spend("landed", 1.0)
    bench.take_off("take off after a new life")
    bench.driver.send(signal.SIGKILL)
    time.sleep(0.1)
    with bench.mark("landed by others"), bench.failsafe() as say:
        for number in range(150):
            say("land" if number > 5 else "hover")
            time.sleep(0.1)
            if bench.now.on_ground and not bench.now.motors:
                break


@script()
def _orphaned(bench: Bench) -> None:
    """The supervisor stands still for a moment, then dies."""
    track_ahead(bench)
    bench.up.beats = False
    bench.spend("supervisor frozen", 0.8)
    bench.up.beats = True
    bench.spend("supervisor again", 0.8)
    bench.driver.orphan()
    bench.await_landing("orphaned")
    with bench.mark("exit of an orphan"):
        bench.wait(lambda: not bench.driver.alive, 6.0, must=False)
        bench.record.facts["orphan ended"] = float(not bench.driver.alive)


@script()
def _unheard(bench: Bench) -> None:
    """The vehicle sends nothing for a while, then for good, and still receives."""
    track_ahead(bench)
    bench.emulator.silent = True
    bench.spend("radio pauses", 1.6)
    bench.emulator.silent = False
    bench.spend("heard in time", 1.0)
    bench.spend("goes on", 2.0)
    bench.emulator.silent = True
    bench.spend("silent vehicle", 1.5)
    bench.await_landing("landing unheard")
    bench.emulator.silent = False
    bench.spend("heard again", 2.5)
    bench.end()


@script()
def _cut(bench: Bench) -> None:
    """CUT_MOTORS in the air, and a new start after it."""
    bench.track()
    bench.order("cut", Verb.CUT_MOTORS)
    bench.await_landing("fall", 4.0)
    bench.spend("cut", 1.5)
    bench.order("land after the cut", Verb.LAND)
    bench.take_off("take off after the cut")
    bench.room.do(lambda: setattr(bench.room.body, "battery", LOW_BATTERY))
    bench.await_landing("landing with a low battery")
    time.sleep(0.5)
    bench.end()


@script(Fault(kind=FaultKind.TELEMETRY_FROZEN, entity=NAME, start_s=FAULT_S))
def _frozen(bench: Bench) -> None:
    """From one moment on the vehicle repeats its last report."""
    _fly_into(bench, "frozen")


@script(Fault(kind=FaultKind.VELOCITY_JUMPING, entity=NAME, start_s=FAULT_S, value=3.0))
def _jumping(bench: Bench) -> None:
    """From one moment on its reported velocity is off by 3 m/s."""
    _fly_into(bench, "jumping")


@script()
def _damaged(bench: Bench) -> None:
    """Damaged datagrams between the good ones, on the ground; then a flight."""
    bench.connect()
    time.sleep(0.5)
    wire, before = bench.room.wire, len(bench.record.heard(RAW_RX))
    wanted = round(bench.record.facts["damaged"])
    status = bench.newest(VEHICLE_STATUS)
    wire.copies = max(1, min(200, round(wanted / (_DAMAGED_S * max(5.0, status.rate_hz)))))
    with bench.mark("damaged"):
        bench.wait(lambda: wire.damaged >= wanted or not bench.driver.alive, 120.0, must=False)
    wire.copies = 0
    bench.record.facts["sent damaged"] = wire.damaged
    bench.record.facts["alive"] = float(bench.driver.alive)
    bench.record.facts["heard before"] = before
    bench.spend("after the damage", 3.0)
    bench.take_off("take off after the damage")
    bench.order("land after the damage", Verb.LAND)
    bench.await_landing("landing after the damage")
    bench.end()


def _fly_into(bench: Bench, mark: str) -> None:
    bench.track()
    if bench.room.world.time_s > FAULT_S - 2.0:
        raise FlightFailed(f"the vehicle tracks only after {bench.room.world.time_s:.0f} s: too late for the fault")
    while bench.room.world.time_s < FAULT_S - 1.0:
        time.sleep(0.02)
    bench.up.wanted = ((LIMITS.max_speed_m_s / 2, 0.0, 0.0), 0.0)
    while bench.room.world.time_s < FAULT_S:
        time.sleep(0.005)
    if bench.now.on_ground:
        raise FlightFailed(f"it landed before its reports became wrong; {bench.last_words()}")
    with bench.mark(mark):
        bench.await_landing(f"landing {mark}", 12.0)
    bench.driver.send(signal.SIGTERM)
    bench.await_exit(4.0)
