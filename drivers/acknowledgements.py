"""Answers to commands, and the moment when an accepted one becomes effective. Pure."""

from drivers.watchdog_types import ALOFT, FREE, Ack, DriverMode, VehicleView
from groundstation.bus.messages import UP, AckStage, Command, FlightState, Verb

_REMEMBERED_COMMANDS = 256


class AckBook:
    """Remembers answers by the command's id, and the accepted commands that are not effective yet: all of one verb."""

    def __init__(self) -> None:
        self._answers: dict[str, Ack] = {}
        self._pending: list[Command] = []

    def answered(self, command: Command) -> Ack | None:
        """Return the earlier answer to this command."""
        return self._answers.get(command.id)

    def answer(self, command: Command, refusal: str, final: bool = False) -> Ack:
        """Note the answer to a command, and wait for an accepted one to become effective; final: see `CommandAck`."""
        stage = AckStage.REFUSED if refusal else AckStage.ACCEPTED
        answer = Ack(command.id, command.verb, stage, refusal, final)
        if len(self._answers) >= _REMEMBERED_COMMANDS:
            self._answers.pop(next(iter(self._answers)))
        self._answers[command.id] = answer
        if not refusal:
            self._pending = [*(one for one in self._pending if one.verb is command.verb), command]
        return answer

    def enter(self, mode: DriverMode) -> None:
        """Drop the commands that can no longer become effective in a mode."""
        if mode not in ALOFT:
            self._pending = [one for one in self._pending if one.verb in (Verb.LAND, Verb.CUT_MOTORS)]

    def effective(self, mode: DriverMode, vehicle: VehicleView, flies: bool) -> tuple[Ack, ...]:
        """Return the answers that are due; flies: whether a setpoint is obeyed."""
        if not self._pending or not _is_effective(self._pending[0].verb, mode, vehicle, flies):
            return ()
        acks = tuple(Ack(one.id, one.verb, AckStage.EFFECTIVE) for one in self._pending)
        self._pending = []
        self._answers |= {ack.command_id: ack for ack in acks}
        return acks


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
