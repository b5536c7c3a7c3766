"""A watchdog with an obedient vehicle, on a manual clock."""

import itertools

import pytest

from drivers.watchdog import Watchdog
from drivers.watchdog_types import Action, Upstream, VehicleView, WatchdogLimits
from groundstation.bus.messages import AckStage, Command, FlightState, Header, Lease, VelocitySetpoint, Verb

MS = 1_000_000
S = 1_000_000_000
STEP = 33 * MS


class Bench:
    """A watchdog with an obedient vehicle, run step by step on a manual clock."""

    def __init__(self, state=FlightState.LANDED, clears=False, **limits):
        self.watchdog = Watchdog(WatchdogLimits(**limits), "clock")
        self.now = 100 * S
        self.state = state
        self.fresh = True
        self.battery = 0.9
        self.not_ready = self.unsound = self.stray = self.stray_by = ""
        self.speed = self.unseen_s = self.lost_s = 0.0
        self.unseen = self.lost = self.touches_down = self.on_floor = False
        self.seen = True
        self.near, self.crowded, self.away, self.clears = "", "", "", clears
        self.outside = ""
        self.height, self.homeward, self.foreign, self.settles = 1.2, "", False, False
        self.piloted, self.refuses = False, ""
        self.holds = False
        self.upstream = Upstream()
        self.epoch = 1
        self.ids = itertools.count()
        self.numbers = itertools.count()
        self.tracker_speaks = False
        self.converged = True
        self.lease_alive = True
        self.decision = self.step()

    def header(self, stamp=None, seq=0, clock="clock"):
        return Header(self.now if stamp is None else stamp, clock, "drone_1", "tester", seq)

    def step(self, dt=STEP):
        self.now += dt
        self.unseen_s = self.unseen_s + dt / S if self.unseen else 0.0
        self.lost_s = self.lost_s + dt / S if self.lost else 0.0
        if self.lease_alive:
            self.watchdog.accept_lease(self.now, Lease(header=self.header(), holder="op", expires_ns=self.now + 2 * S))
        if self.tracker_speaks:
            self.setpoint()
        self.decision = self.watchdog.step(self.now, self.view, self.upstream)
        return self.decision

    @property
    def view(self):
        view = VehicleView(self.state, self.fresh, self.battery, self.not_ready, unsound=self.unsound)
        seen = view._replace(unseen_s=self.unseen_s, lost_s=self.lost_s, near=self.near, crowded=self.crowded)
        seen = seen._replace(
            outside=self.outside,
            touches_down=self.touches_down,
            on_floor=self.on_floor,
            foreign=self.foreign,
            settles=self.settles,
        )
        seen = seen._replace(
            height_m=self.height, away=self.away, homeward=self.homeward, piloted=self.piloted, refuses=self.refuses
        )
        return seen._replace(
            speed_m_s=self.speed, seen=self.seen, stray=self.stray, stray_by=self.stray_by, clears=self.clears
        ).plausible

    def see(self):
        """Give the vehicle's state to the watchdog, as its host does before it passes on commands."""
        self.watchdog.see(self.view, self.upstream)

    def run(self, seconds):
        decisions = [self.step() for _ in range(round(seconds * S / STEP))]
        return [decision.action for decision in decisions]

    def setpoint(self, velocity=(0.3, 0.0, 0.0), *, seq=None, epoch=None, lifetime=300, stamp=None, clock="clock"):
        number = next(self.numbers)
        message = VelocitySetpoint(
            header=self.header(stamp, number if seq is None else seq, clock),
            velocity_m_s=velocity,
            yaw_rate_rad_s=0.1,
            lifetime_ms=lifetime,
            epoch=self.epoch if epoch is None else epoch,
            converged=self.converged,
            holds=self.holds,
        )
        return self.watchdog.accept_setpoint(self.now, message)

    def order(self, verb, issuer="op", expires=None, id=None, clock="clock"):
        stopping = verb in (Verb.HOLD, Verb.LAND, Verb.CUT_MOTORS)
        expires_ns = expires if expires is not None else (0 if stopping else self.now + 5 * S)
        command = Command(
            header=self.header(clock=clock),
            id=id or f"c{next(self.ids)}",
            verb=verb,
            scope=(),
            issuer=issuer,
            expires_ns=expires_ns,
        )
        return self.watchdog.accept_command(self.now, command)[-1]

    def fly(self):
        """Take off and track."""
        assert self.order(Verb.TAKEOFF).stage is AckStage.ACCEPTED
        self.state = FlightState.TAKING_OFF
        self.step()
        self.state = FlightState.HOVERING
        self.tracker_speaks = True
        self.step()
        assert self.order(Verb.TRACK).stage is AckStage.ACCEPTED
        assert self.step().action is Action.FLY
        return self


@pytest.fixture
def new_bench():
    """Build a bench from the vehicle's state and the differing limits."""
    return Bench
