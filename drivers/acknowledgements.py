"""Answers to commands, and the moment when an accepted one becomes effective. Pure."""

from drivers.watchdog_types import ALOFT, FREE, Ack, DriverMode, VehicleView
from groundstation.bus.messages import UP, AckStage, Command, FlightState, Verb

_REMEMBERED_COMMANDS = 256


class AckBook:
    """Remembers answers by the command's id, and the accepted command that is not effective yet."""

    def __init__(self) -> None:
        self._answers: dict[str, Ack] = {}
        self._pending: Command | None = None

    def answered(self, command: Command) -> Ack | None:
        """Return the earlier answer to this command."""
        return self._answers.get(command.id)

    def answer(self, command: Command, refusal: str) -> Ack:
        """Note the answer to a command, and wait for an accepted one to become effective."""
        stage = AckStage.REFUSED if refusal else AckStage.ACCEPTED
        answer = Ack(command.id, command.verb, stage, refusal)
        if len(self._answers) >= _REMEMBERED_COMMANDS:
            self._answers.pop(next(iter(self._answers)))
        self._answers[command.id] = answer
        if not refusal:
            self._pending = command
        return answer

    def enter(self, mode: DriverMode) -> None:
        """Drop the commands that can no longer become effective in a mode."""
        if mode not in ALOFT and self._pending is not None and self._pending.verb not in (Verb.LAND, Verb.CUT_MOTORS):
            self._pending = None

    def effective(self, mode: DriverMode, vehicle: VehicleView, flies: bool) -> tuple[Ack, ...]:
        """Return the answers that are due; flies: whether a setpoint is obeyed."""
        if self._pending is None or not _is_effective(self._pending.verb, mode, vehicle, flies):
            return ()
        ack = Ack(self._pending.id, self._pending.verb, AckStage.EFFECTIVE)
        self._pending = None
        self._answers[ack.command_id] = ack
        return (ack,)


def _is_effective(verb: Verb, mode: DriverMode, vehicle: VehicleView, flies: bool) -> bool:
    # Judged by the vehicle's reports, not by what was sent.
    state = vehicle.flight_state if vehicle.fresh else FlightState.UNKNOWN
    match verb:
        case Verb.TAKEOFF:
            return mode in FREE and state in UP
        case Verb.TRACK | Verb.RESUME:
            return flies
        case Verb.HOLD:
            still = (FlightState.HOVERING, FlightState.LANDED)
            return mode in (DriverMode.HOLD, DriverMode.LANDED) and state in still
        case Verb.LAND:
            return state is FlightState.LANDED
        case Verb.CUT_MOTORS:
            return state in (FlightState.EMERGENCY, FlightState.LANDED)
