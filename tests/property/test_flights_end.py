"""Random orders, silences and restarts, and a vehicle that ignores some orders: nothing flies on unheeded afterwards.

40 s after the last order and the last fault a vehicle is down, or follows the tracker, or hovers because a person
ordered that: nothing flies while its driver takes it for landed or cut, and no hover that waits for an order lasts.
"""

import random

import pytest

from drivers.watchdog import Watchdog
from drivers.watchdog_types import Action, DriverMode, Upstream, VehicleView, WatchdogLimits
from groundstation.bus.messages import AIRBORNE, Command, FlightState, Header, Lease, VelocitySetpoint, Verb

S = 1_000_000_000
TURN, LATER = S // 10, S // 4
_CLIMB_S, _SINK_S, _FALL_S = 1.2, 2.0, 0.4
_TROUBLES = 120


class Vehicle:
    """Obeys what arrives, but for some orders to cut its motors; its reports may be missing."""

    def __init__(self, rng: random.Random, clears: bool) -> None:
        self.rng, self.clears = rng, clears
        self.state, self.since_ns, self.told = FlightState.LANDED, 0, Action.WAIT
        self.deaf = self.silent = self.unreached = False
        self.reported = FlightState.UNKNOWN

    @property
    def view(self) -> VehicleView:
        if not self.silent:
            self.reported = self.state
        return VehicleView(self.reported, not self.silent, 0.9, clears=self.clears)

    def obey(self, now_ns: int, action: Action) -> None:
        if action is not self.told:
            self.told, self.deaf = action, self.rng.random() < 0.5
        aloft = self.state in AIRBORNE
        if self.unreached:
            pass
        elif action is Action.TAKE_OFF and not aloft and (self.state is FlightState.LANDED or not self.clears):
            self._be(now_ns, FlightState.TAKING_OFF)
        elif action is Action.CLEAR and self.state is FlightState.EMERGENCY:
            self._be(now_ns, FlightState.LANDED)
        elif action is Action.LAND and aloft and self.state is not FlightState.LANDING:
            self._be(now_ns, FlightState.LANDING)
        elif action is Action.CUT and aloft and not self.deaf and now_ns - self.since_ns > _FALL_S * S:
            self._be(now_ns, FlightState.EMERGENCY if self.clears else FlightState.LANDED)
        self._go_on(now_ns)

    def _go_on(self, now_ns: int) -> None:
        lasted_s = (now_ns - self.since_ns) / S
        if self.state is FlightState.TAKING_OFF and lasted_s > _CLIMB_S:
            self._be(now_ns, FlightState.HOVERING)
        elif self.state is FlightState.LANDING and lasted_s > _SINK_S:
            self._be(now_ns, FlightState.LANDED)

    def _be(self, now_ns: int, state: FlightState) -> None:
        self.state, self.since_ns = state, now_ns


class Flight:
    """A driver's watchdog with that vehicle, a tracker, and somebody who presses buttons at random."""

    def __init__(self, seed: int) -> None:
        self.rng = rng = random.Random(seed)
        self.dog, self.now_ns, self.number = Watchdog(WatchdogLimits(), "clock"), 100 * S, 0
        self.vehicle = Vehicle(rng, clears=rng.random() < 0.5)
        self.epoch, self.speaks, self.stray, self.upstream = 1, True, "", Upstream()
        self.outside = ""

    def _header(self) -> Header:
        self.number += 1
        return Header(self.now_ns, "clock", "drone_1", "tester", self.number)

    def turn(self, step_ns: int) -> None:
        self.now_ns += step_ns
        self.dog.accept_lease(self.now_ns, Lease(header=self._header(), holder="op", expires_ns=self.now_ns + S))
        if self.speaks:
            setpoint = VelocitySetpoint(
                header=self._header(), velocity_m_s=(0.3, 0.0, 0.0), yaw_rate_rad_s=0.0, lifetime_ms=300,
                epoch=self.epoch, converged=True,
            )  # fmt: skip
            self.dog.accept_setpoint(self.now_ns, setpoint)
        view = self.vehicle.view._replace(stray=self.stray, outside=self.outside)
        decision = self.dog.step(self.now_ns, view, self.upstream)
        self.vehicle.obey(self.now_ns, decision.action)

    def trouble(self) -> None:
        """Begin or end a fault, or order something."""
        rng, what = self.rng, self.rng.random()
        if what < 0.2:
            verb = rng.choice(list(Verb))
            order = Command(
                header=self._header(), id=str(self.number), verb=verb, scope=(), issuer="op",
                expires_ns=self.now_ns + S,
            )  # fmt: skip
            self.dog.accept_command(self.now_ns, order)
        elif what < 0.28:
            self.vehicle.silent = not self.vehicle.silent
        elif what < 0.32:
            self.vehicle.unreached = not self.vehicle.unreached
        elif what < 0.36:
            self.speaks = not self.speaks
        elif what < 0.38:
            self.epoch += 1
        elif what < 0.40:
            self.stray = "" if self.stray else "1.0 m/s"
        elif what < 0.42:
            self.upstream = Upstream(supervisor_fresh=not self.upstream.supervisor_fresh)
        elif what < 0.43:
            self.now_ns += S  # the driver stands still
        elif what < 0.45:
            self.outside = "" if self.outside else "it is 0.4 m outside the fence"

    def settle(self, seconds: float) -> None:
        self.vehicle.silent = self.vehicle.unreached = False
        self.stray, self.outside, self.upstream = "", "", Upstream()
        for _ in range(round(seconds * S / LATER)):
            self.turn(LATER)

    @property
    def heeded(self) -> bool:
        """Return whether the vehicle is down, or flies because somebody ordered that."""
        if self.vehicle.state not in AIRBORNE:
            return True
        mode = self.dog.mode
        return mode in (DriverMode.TRACK, DriverMode.HOLD) or (mode is DriverMode.HOVER and not self.dog.failsafe)


def fly(seed: int) -> Flight:
    """Return a flight that began well, after up to 120 troubles."""
    flight = Flight(seed)
    flight.turn(TURN)
    for verb, turns in ((Verb.TAKEOFF, 20), (Verb.TRACK, 3)):
        order = Command(
            header=flight._header(), id=verb, verb=verb, scope=(), issuer="op", expires_ns=flight.now_ns + S
        )
        flight.dog.accept_command(flight.now_ns, order)
        for _ in range(turns):
            flight.turn(TURN)
    for _ in range(flight.rng.randint(1, _TROUBLES)):
        flight.trouble()
        flight.turn(TURN)
    return flight


@pytest.mark.parametrize("part", range(2))
def test_nothing_flies_on_unheeded(part: int) -> None:
    unheeded = []
    for seed in range(100 * part, 100 * (part + 1)):
        flight = fly(seed)
        flight.settle(40.0)
        if not flight.heeded:
            unheeded.append((seed, flight.vehicle.state, flight.dog.mode, flight.dog.reason))
    assert not unheeded, f"{len(unheeded)} of 100: {unheeded[:5]}"
