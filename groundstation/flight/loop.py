"""One flight from start to landing: supervisor and operator in one loop, until time is up or a person stops it."""

import time
from dataclasses import dataclass

from groundstation.bus.messages import ALL_DOWN, RUN, RUN_ENDED, SOME_UNHEARD, Event, FlightState, Severity
from groundstation.bus.topics import EVENT
from groundstation.errors import GroundStationError
from groundstation.flight.flight_plan import FlightPlan
from groundstation.flight.keyboard import Keyboard
from groundstation.flight.looking import Looking
from groundstation.process.sleep_watch import SleepWatch
from groundstation.runtime.before_take_off import BeforeTakeOff
from groundstation.runtime.operator import Operator
from groundstation.runtime.team import TeamPhase, TeamStatus
from groundstation.supervisor.start import Interrupted, Start
from groundstation.supervisor.supervisor import Supervisor
from groundstation.supervisor.terminal import Terminal
from groundstation.time_units import NS_PER_S

_FAILED_LANDING_S = 2.0
_LANDING = {True: ALL_DOWN, False: "not every drone reported a landing", None: SOME_UNHEARD}
_HEARD_NS = NS_PER_S // 2  # drivers report five times a second


@dataclass(frozen=True, slots=True)
class FlightOutcome:
    """The end of a flight. failure: why it could not continue, or ""; interrupted: by the operator.

    landed: nobody reported to fly at the end; None: nor was every drone heard.
    forbidden: whether the take-off was forbidden, if that was asked.
    """

    failure: str
    interrupted: bool
    landed: bool | None
    forbidden: bool = False


class Flight:
    """Runs one flight; call `run` once. keyboard: where the operator answers the prompt (default: standard input)."""

    def __init__(
        self, supervisor: Supervisor, plan: FlightPlan, terminal: Terminal, keyboard: Keyboard | None = None
    ) -> None:
        self._supervisor = supervisor
        self._start = Start(supervisor)
        self._plan = plan
        self._terminal = terminal
        self._began_ns = time.monotonic_ns()
        self._keyboard, self._sleep = keyboard or Keyboard(), SleepWatch()
        self._prompting = False
        self._looking: Looking | None = None
        self._grounded = False
        self._forbidden = False

    def run(self) -> FlightOutcome:
        """Start, fly, land, end the run. Raises GroundStationError when the start failed; the run is ended then too."""
        try:
            outcome = self._start_and_fly()
            self._announce(*end_of(outcome))
            return outcome
        finally:
            self._supervisor.end_run()
            self._terminal.unmute()

    def _start_and_fly(self) -> FlightOutcome:
        supervisor = self._supervisor
        try:
            self._start.run()
        except Interrupted:
            return FlightOutcome("", interrupted=True, landed=self._stand())
        except GroundStationError as error:
            self._announce(Severity.ERROR, f"its start failed: {str(error).splitlines()[0]}")
            raise
        assert supervisor.bus is not None
        plan = self._plan
        checks = None if plan.field is None else BeforeTakeOff(supervisor.bus, plan.field, plan.cautions)
        operator = Operator(supervisor.bus, supervisor.run.drones, plan.cameras, plan.limits, self._say, checks)
        if checks is not None and self._look(operator, checks):
            standing = stand(operator.team, time.monotonic_ns())
            return FlightOutcome("", supervisor.interrupts.stop_requested, standing, self._forbidden)
        failure = self._fly(operator)
        landed = self._land(operator)
        return FlightOutcome(failure, supervisor.interrupts.stop_requested, landed)

    def _stand(self) -> bool | None:
        """Return `stand` of what is heard within a moment; a drone that is found flying is landed by its driver."""
        supervisor = self._supervisor
        if supervisor.bus is None:
            return None  # no driver was started
        team, end_ns = TeamStatus(supervisor.bus, supervisor.run.drones, {}), time.monotonic_ns() + _HEARD_NS
        while (now_ns := time.monotonic_ns()) < end_ns and not supervisor.interrupts.hurry:
            supervisor.step()
            team.update(now_ns)
        return stand(team, now_ns)

    def _announce(self, severity: Severity, how: str) -> None:
        """Publish the end of the run, and its reason, while other processes still listen."""
        if self._supervisor.bus is not None:
            header = self._supervisor.bus.header(RUN)
            self._supervisor.bus.publish(EVENT, Event(header=header, severity=severity, text=f"{RUN_ENDED}{how}"))

    def _say(self, text: str) -> None:
        elapsed_s = (time.monotonic_ns() - self._began_ns) / NS_PER_S
        self._terminal.say(f"{elapsed_s:6.1f} s  {text}")

    def _turn(self, operator: Operator) -> int:
        self._supervisor.step()
        now_ns = time.monotonic_ns()
        for process in self._supervisor.processes:
            if process.spec.role == "driver" and process.left_when_told():
                operator.heed_signal(process.spec.name, now_ns)
        operator.step(now_ns)
        return now_ns

    def _breaks_off(self) -> bool:
        """Return whether a failure, or Ctrl-C, ends the present step."""
        return bool(self._supervisor.failure) or self._supervisor.interrupts.stop_requested

    def _state(self) -> str:
        unwell = self._supervisor.unwell
        return f"NOT WELL YET (see above): {', '.join(unwell)}" if unwell else "all processes are ready"

    # -- look ----------------------------------------------------------------------------------------------------

    def _look(self, operator: Operator, checks: BeforeTakeOff) -> bool:
        """Wait for the evidence of the checks, and report the findings; return whether the run ends here."""
        self._looking = looking = Looking(checks, self._supervisor.run.drones, self._turn(operator))
        while not self._breaks_off():
            if looking.finished(self._turn(operator)):
                for line in looking.report(whole=self._plan.look_only):
                    self._say(line)
                self._forbidden = looking.forbidden or (self._plan.look_only and looking.nobody)
                return self._plan.look_only
        return False

    # -- fly -----------------------------------------------------------------------------------------------------

    def _fly(self, operator: Operator) -> str:
        """Continue until there is a reason to land; returns the reason if it is a failure."""
        now_ns = self._turn(operator)
        if self._plan.look_only or self._breaks_off():
            return self._supervisor.failure  # a failure during the checks must not be answered by a take-off
        if self._plan.asks:
            self._ask()
        elif failure := self._take_off(operator, now_ns):
            return failure
        began_ns = now_ns
        while True:
            now_ns = self._turn(operator)
            if self._prompting:
                self._prompt(operator, now_ns)
            self._tell_grounded(operator, now_ns)
            if self._breaks_off():
                return self._supervisor.failure
            slept_s = self._sleep.slept_s()
            if slept_s and self._plan.asks and not operator.landed(now_ns):
                return f"this computer slept for {slept_s:.0f} s in flight: nobody watched over the drones"
            if self._plan.asks and operator.phase is TeamPhase.GROUND:
                began_ns = now_ns
            ended, failure = self._is_over(operator, now_ns, began_ns)
            if ended:
                return failure

    def _ask(self) -> None:
        self._prompting = True
        self._keyboard.forget()
        insist = "type anyway and press Enter" if self._forbidden else "press Enter"
        self._say(f"{self._state()}. To take off and track {insist} (Ctrl-C ends), or use: groundstation takeoff")

    def _take_off(self, operator: Operator, now_ns: int) -> str:
        """Order the take-off; return why it was forbidden, "" if it was not."""
        self._say(f"{self._state()}; taking off")
        operator.take_off(now_ns, anyway=self._plan.anyway, given_ns=self._began_ns)
        if operator.forbidden:
            return f"nobody took off: {operator.forbidden}{'; to fly all the same: --anyway' * self._forbidden}"
        self._start.show_screen()
        return ""

    def _tell_grounded(self, operator: Operator, now_ns: int) -> None:
        """Report what the run waits for if drones landed without an order for all: by watchdogs, or one order each."""
        if operator.phase not in (TeamPhase.UP, TeamPhase.TRACKING, TeamPhase.HELD):
            self._grounded = False
        elif operator.landed(now_ns) and not self._grounded:
            self._grounded = True  # until the next take-off: a drone not heard for a while counts as airborne
            self._say(
                "all drones have landed without an order to all (why: see the events). Ctrl-C ends the run; to fly "
                "again: groundstation takeoff, then groundstation track"
            )

    def _is_over(self, operator: Operator, now_ns: int, began_ns: int) -> tuple[bool, str]:
        if self._plan.asks and (self._plan.duration_s is None or operator.phase is TeamPhase.GROUND):
            return False, ""
        if operator.mistake is not None:
            return True, str(operator.mistake)
        if operator.phase is TeamPhase.GROUND:
            return True, "no drone took off"
        if operator.phase is TeamPhase.LANDING and operator.landed(now_ns):
            return True, ""  # landed by someone else's order
        duration_s = self._plan.duration_s
        if duration_s is None:
            return False, ""
        since_ns = operator.tracking_since_ns
        if since_ns:
            return now_ns - since_ns >= duration_s * NS_PER_S, ""
        late = now_ns - began_ns > self._plan.start_tracking_limit_s * NS_PER_S
        return late, "tracking did not begin" if late else ""

    def _prompt(self, operator: Operator, now_ns: int) -> None:
        if operator.phase is not TeamPhase.GROUND:
            self._prompting = False  # another shell took off first
        else:
            self._answer(operator, now_ns)
            if self._looking is not None and (anew := self._looking.told_anew(now_ns)):
                self._say(anew)
        if not self._prompting:
            self._start.show_screen()

    def _answer(self, operator: Operator, now_ns: int) -> None:
        """Take typed input: Enter alone, or the word "anyway", takes off; nothing else does."""
        word = self._keyboard.line()
        if self._keyboard.gone:
            self._prompting = False
            self._say("no keyboard here: waiting for groundstation takeoff")
        elif word in (b"", b"anyway"):
            operator.take_off(now_ns, anyway=self._plan.anyway or word == b"anyway")
            self._prompting = bool(operator.forbidden)
            if self._prompting:
                self._say("fix it and press Enter, or type anyway and press Enter")
        elif word is not None:
            self._say("nobody takes off by that: press Enter alone to take off, Ctrl-C to end")

    # -- land ----------------------------------------------------------------------------------------------------

    def _land(self, operator: Operator) -> bool | None:
        """Land all drones and wait; returns whether all reported that they have landed, as `stand` does."""
        supervisor = self._supervisor
        now_ns = time.monotonic_ns()
        if not operator.landed(now_ns):
            self._say("landing")
        operator.land(now_ns)
        # Without the simulator no drone can report a landing, except a real one.
        patient = self._plan.asks or not supervisor.failure
        limit_s = self._plan.landing_limit_s if patient else _FAILED_LANDING_S
        deadline_ns = now_ns + int(limit_s * NS_PER_S)
        while now_ns < deadline_ns and not supervisor.interrupts.hurry:
            now_ns = self._turn(operator)
            if operator.landed(now_ns):
                standing = stand(operator.team, now_ns)
                self._say("all drones have landed" if standing else f"nobody is known to fly; {SOME_UNHEARD}")
                return standing
        aloft = ", ".join(operator.team.airborne(now_ns))
        self._say(f"stopping, though {aloft or 'nobody'} did not report a landing")
        return stand(operator.team, now_ns)


def stand(team: TeamStatus, now_ns: int) -> bool | None:
    """Return whether all drones report that they stand; None: some were not heard, and none is known to fly.

    One that was switched off after it stood counts as standing.
    """
    if team.airborne(now_ns):
        return False
    return None if any(member.state is FlightState.UNKNOWN for member in team.members.values()) else True


def end_of(outcome: FlightOutcome) -> tuple[Severity, str]:
    """Return severity and text of the end of a run."""
    landing = _LANDING[outcome.landed]
    if outcome.failure:
        return Severity.ERROR, f"{outcome.failure.splitlines()[0]}; {landing}"
    severity = Severity.INFO if outcome.landed else Severity.WARNING
    return severity, f"stopped by the operator; {landing}" if outcome.interrupted else landing


def require_outcome(outcome: FlightOutcome) -> None:
    """Raise GroundStationError for a flight that failed."""
    if outcome.failure:
        raise GroundStationError(outcome.failure)
