"""The operator: holds the lease, gives orders, takes off, and serves the requests of other shells."""

from collections.abc import Callable, Mapping

from groundstation.bus import clock
from groundstation.bus.api import Bus
from groundstation.bus.messages import (
    OPERATOR,
    AckStage,
    Command,
    CommandAck,
    Event,
    Lease,
    Severity,
    Verb,
)
from groundstation.bus.stop_mark import StopMark, why_another_runs, why_too_old
from groundstation.bus.topics import COMMAND, COMMAND_ACK, EVENT, LEASE
from groundstation.runtime.acknowledgements import AwaitedAnswers
from groundstation.runtime.asking import TEAM
from groundstation.runtime.before_take_off import BeforeTakeOff
from groundstation.runtime.given_orders import GivenOrders
from groundstation.runtime.lift_off import Mistake
from groundstation.runtime.marker_height import FixedCamera
from groundstation.runtime.requests import Requests, asks_for_start, named
from groundstation.runtime.take_off import TakeOff, TakeOffCommand, TakeOffLimits
from groundstation.runtime.team import TeamPhase, TeamStatus
from groundstation.time_units import NS_PER_MS

_LEASE_PERIOD_NS = 500 * NS_PER_MS
_LEASE_LIFE_NS = 1_500 * NS_PER_MS
_OBEYED = (AckStage.ACCEPTED, AckStage.EFFECTIVE)
_IN_THE_AIR = (TeamPhase.UP, TeamPhase.TRACKING, TeamPhase.HELD)


class Operator:
    """Call `step` 10 times a second or more; `say` receives lines for the person.

    cameras: those fixed in the world; mistake, forbidden: why the last take-off was stopped, or did not begin.
    """

    def __init__(
        self,
        bus: Bus,
        drones: tuple[str, ...],
        cameras: Mapping[str, FixedCamera],
        limits: TakeOffLimits,
        say: Callable[[str], None],
        checks: BeforeTakeOff | None = None,
    ) -> None:
        self._bus = bus
        self._say = say
        self._limits = limits
        self._checks = checks
        self.forbidden = ""
        self.team = TeamStatus(bus, drones, cameras)
        self.phase = self._phase_before = TeamPhase.GROUND
        self.mistake: Mistake | None = None
        self.tracking_since_ns = 0
        self._inbox = bus.subscribe([COMMAND, COMMAND_ACK])
        self._requests = Requests(bus, drones)
        self._given = GivenOrders(bus, self._requests, say)
        self._sequence: TakeOff | None = None
        self._sequence_request: Command | None = None
        self._take_off_book: AwaitedAnswers | None = None
        self._then_track = False
        self._next_lease_ns = 0

    # -- orders --------------------------------------------------------------------------------------------------

    def take_off(self, now_ns: int, drones: tuple[str, ...] = (), anyway: bool = False, given_ns: int = 0) -> None:
        """Take off with all or given drones, then track, unless `forbidden` or stopped since given_ns (0: now)."""
        overtaken = self._requests.overtaken(given_ns or now_ns)
        self.forbidden = overtaken or self._forbids(now_ns, drones, OPERATOR if anyway else "")
        if self.forbidden:
            self._say(f"TAKE-OFF REFUSED: {self.forbidden}")
            return
        self._begin(now_ns, drones, then_track=True)

    def _forbids(self, now_ns: int, drones: tuple[str, ...], insists: str) -> str:
        """Return why nobody may take off, or "" if nothing is wrong or somebody insists, which is recorded."""
        if self._checks is None:
            return ""
        musts = self._checks.forbids(now_ns, drones)
        if musts and insists:
            self._checks.record_override(insists, musts)
            self._say(f"taking off although {len(musts)} finding(s) must be mended: {insists} insists")
            return ""
        return "; ".join(f"{one.subject}: {one.found} -> {one.remedy}" for one in musts)

    def _begin(self, now_ns: int, drones: tuple[str, ...], then_track: bool) -> None:
        self._sequence = TakeOff(drones or tuple(self.team.members), self._limits, now_ns, self.team.flying)
        self._then_track = then_track
        self.mistake = None
        self._phase_before, self.phase = self.phase, TeamPhase.TAKING_OFF

    def track(self, now_ns: int, drones: tuple[str, ...] = (), request: Command | None = None) -> None:
        """Let the tracker move the given drones (none given: all that fly)."""
        self._give(Verb.TRACK, drones or self.team.up, now_ns, request)

    def land(self, now_ns: int) -> None:
        """Land all drones, and end everything else in progress."""
        # Not judged by the phase: another shell's LAND sets it as well, and may have been lost on its way to the
        # drones.
        self.phase = TeamPhase.LANDING
        again = self._given.lands_all
        stop = self._stop_of_all("land", OPERATOR, now_ns) if again else self._give(Verb.LAND, (), now_ns).command
        self._requests.hear_stop(now_ns, stop)
        self._end_starts(stop, now_ns)

    def heed_signal(self, driver: str, now_ns: int) -> None:
        """Let no start go on after somebody signalled a driver to land and end, as shells do that reach no router.

        Such a stop may have been meant for more drivers, so it counts for the team; drones in the air fly on.
        """
        stop = self._stop_of_all(f"signal-{driver}", f"a signal to {driver}", now_ns)
        self._requests.hear_stop(now_ns, stop)
        self._end_starts(stop, now_ns)
        if self.phase is TeamPhase.TAKING_OFF:
            flew = self._phase_before in _IN_THE_AIR and not self.landed(now_ns)
            self.phase = self._phase_before if flew else TeamPhase.LANDING
        self._say(f"{driver}'s driver was told by a signal to land and end: no earlier order starts anything")

    def _stop_of_all(self, what: str, issuer: str, now_ns: int) -> Command:
        """Return a LAND that ends starts here; it is sent to nobody."""
        header = self._bus.header(TEAM, now_ns)
        return Command(header=header, id=f"{what}-{now_ns}", verb=Verb.LAND, scope=(), issuer=issuer, run=self._bus.run)

    def landed(self, now_ns: int) -> bool:
        """Return whether no drone is in the air, as far as the drones report."""
        return not self.team.airborne(now_ns)

    def _end_starts(self, stop: Command, now_ns: int) -> None:
        """Cancel starts for a stop of the whole team, and answer the shells that requested them."""
        why = _why_ended(stop, now_ns)
        if self._sequence_request is not None:
            self._requests.answer(self._sequence_request, AckStage.REFUSED, why)
        self._sequence, self._sequence_request = None, None
        self._given.end_starts(why)

    def _give(self, verb: Verb, scope: tuple[str, ...], now_ns: int, request: Command | None = None) -> AwaitedAnswers:
        met = (name for name, member in self.team.members.items() if member.heard_ns)
        return self._given.give(verb, scope, met, now_ns, request)

    # -- turn ----------------------------------------------------------------------------------------------------

    def step(self, now_ns: int) -> None:
        """Renew the lease, take messages, and continue orders in progress."""
        if now_ns >= self._next_lease_ns:
            self._next_lease_ns = now_ns + _LEASE_PERIOD_NS
            header = self._bus.header(TEAM)
            end_ns = header.stamp_ns + _LEASE_LIFE_NS
            self._bus.publish(LEASE, Lease(header=header, holder=OPERATOR, expires_ns=end_ns, run=self._bus.run))
        self.team.update(now_ns)
        if self._checks is not None:
            self._checks.update(now_ns)
        # Starts come last: a stop that waits behind one in the queue takes precedence.
        for message in sorted((received.message for received in self._inbox.drain()), key=asks_for_start):
            match message:
                case CommandAck() as ack:
                    self._hear_ack(ack, now_ns)
                case Command() as command if command.header.source != self._bus.source:
                    self._hear_command(command, now_ns)
        self._given.follow(now_ns)
        if self._sequence is not None:
            self._go_on(self._sequence, now_ns)

    def _hear_ack(self, ack: CommandAck, now_ns: int) -> None:
        starts = not ack.verb.stops and ack.verb is not Verb.TAKEOFF and ack.stage in _OBEYED
        if self._given.take(ack) and starts:
            self.tracking_since_ns = self.tracking_since_ns or now_ns
            if self._sequence is None:
                self.phase = TeamPhase.TRACKING
            else:
                self._phase_before = TeamPhase.TRACKING

    def _hear_command(self, command: Command, now_ns: int) -> None:
        if OPERATOR in command.scope:
            self._serve(command, now_ns)
        elif why_another_runs(command, self._bus.run) or why_too_old(command, now_ns, clock.clock_id()):
            return  # no driver obeys it, and drivers report that themselves
        elif command.verb.stops and self._requests.hear_stop(now_ns, command):
            self._hear_stop(command, now_ns)

    def _hear_stop(self, stop: Command, now_ns: int) -> None:
        names = named(stop)
        if not names or set(names) >= set(self.team.members):
            self._end_starts(stop, now_ns)
            if self.phase is not TeamPhase.LANDING:
                if self.phase is not TeamPhase.GROUND or not self.landed(now_ns):
                    self.phase = TeamPhase.HELD if stop.verb is Verb.HOLD else TeamPhase.LANDING
                self._say(f"{stop.verb} by {stop.issuer}")
            return
        self._given.end_starts(_why_ended(stop, now_ns), names)
        if self._sequence is not None:
            for name in names:
                self._sequence.drop(name, f"{stop.verb} by {stop.issuer}", now_ns)
            self._say(f"{stop.verb} {', '.join(names)} by {stop.issuer}")

    # -- requests of other shells --------------------------------------------------------------------------------

    def _serve(self, request: Command, now_ns: int) -> None:
        if self._requests.answer_again(request):
            return
        self._requests.answer(request, AckStage.RECEIVED)
        names = named(request)
        why = self._requests.refusal(now_ns, request) or self._why_not(request, names, now_ns)
        self._requests.answer(request, AckStage.REFUSED if why else AckStage.ACCEPTED, why)
        if not why:
            self._obey(request, names, now_ns)

    def _why_not(self, request: Command, names: tuple[str, ...], now_ns: int) -> str:
        """Return why a start is impossible now, or ""; a stop is always possible."""
        if request.verb.stops:
            return ""
        if request.verb is not Verb.TAKEOFF:
            return self._why_not_on(names)
        if self._sequence is not None:
            return f"{self._sequence.current} is taking off"
        why = self._forbids(now_ns, names, request.issuer if request.anyway else "")
        return f"{why}. Mend it, or insist: groundstation takeoff --anyway" if why else ""

    def _why_not_on(self, names: tuple[str, ...]) -> str:
        """Return why drones may not track or go on, or "": a take-off concerns only those that wait in it."""
        if self._sequence is None:
            return ""
        waiting = [name for name in names if name in self._sequence.waiting]
        if waiting or not self._meant(names):
            return f"{(waiting or [self._sequence.current])[0]} is taking off"
        return ""

    def _meant(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Return whom TRACK or RESUME is for: without names during a take-off, those that do not wait in it."""
        if names or self._sequence is None:
            return names
        return tuple(name for name in self.team.up if name not in self._sequence.waiting)

    def _obey(self, request: Command, names: tuple[str, ...], now_ns: int) -> None:
        match request.verb:
            case Verb.TAKEOFF:
                self._begin(now_ns, names, then_track=False)
                self._sequence_request = request
            case Verb.TRACK:
                self.track(now_ns, self._meant(names), request)
            case Verb.RESUME:
                self._give(Verb.RESUME, self._meant(names), now_ns, request)
            case verb:
                if self._requests.hear_stop(now_ns, request):
                    self._hear_stop(request, now_ns)
                self._give(verb, names, now_ns, request)

    # -- take-off ------------------------------------------------------------------------------------------------

    def _go_on(self, sequence: TakeOff, now_ns: int) -> None:
        progress = self._take_off_book.progress.get(sequence.current) if self._take_off_book else None
        up, left_out = len(sequence.up), len(sequence.left_out)
        order = sequence.step(now_ns, self.team, progress)
        if order is not None:
            self._order(order, now_ns)
        for name in sequence.up[up:]:
            self._say(f"{name}: {'flies already' if name in sequence.flew else 'in the air, localised'}")
        if sequence.mistake is not None:
            self._say(f"TAKE-OFF STOPPED: {sequence.mistake}")
        for name, reason in list(sequence.left_out.items())[left_out:]:
            self._report_left_out(name, reason, sequence)
        if sequence.finished:
            self._finish(sequence, now_ns)

    def _order(self, order: TakeOffCommand, now_ns: int) -> None:
        book = self._give(order.verb, (order.drone,), now_ns)
        if order.verb is Verb.TAKEOFF:
            self._take_off_book = book

    def _report_left_out(self, name: str, reason: str, sequence: TakeOff) -> None:
        text, mistake = f"{name} is left out of the take-off: {reason}", sequence.mistake
        remedy = "order TAKEOFF again once it stands upright" if name in sequence.awaits else "see its log"
        if mistake is not None and reason == mistake.text:
            text, remedy = f"take-off stopped: {reason}", mistake.remedy
        else:
            self._say(f"{name}: left out, {reason}")
        self._bus.publish(
            EVENT, Event(header=self._bus.header(name), severity=Severity.ERROR, text=text, remedy=remedy)
        )

    def _finish(self, sequence: TakeOff, now_ns: int) -> None:
        request, self._sequence, self._sequence_request = self._sequence_request, None, None
        if self._phase_before in _IN_THE_AIR and not self.landed(now_ns):
            self.phase = self._phase_before  # the others have flown all the while
        else:
            self.phase = TeamPhase.UP if sequence.up else TeamPhase.GROUND
        self.mistake = sequence.mistake
        if request is not None:
            missing = "; ".join(f"{name}: {reason}" for name, reason in sequence.left_out.items())
            self._requests.answer(request, AckStage.REFUSED if missing else AckStage.EFFECTIVE, missing)
        if self._then_track and sequence.up and sequence.mistake is None:
            self.track(now_ns, tuple(sequence.up))


def _why_ended(stop: Command, now_ns: int) -> str:
    return StopMark.of(stop, now_ns, clock.clock_id()).words
