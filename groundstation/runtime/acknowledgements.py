"""How far one command has come at each drone: sent, received, accepted, effective, refused, or not confirmed."""

from collections.abc import Collection
from dataclasses import dataclass, field

from msgspec import structs

from groundstation.bus.messages import AckStage, Command, CommandAck

_ORDER = (AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE)
NOT_CONFIRMED = "NOT CONFIRMED"


@dataclass(slots=True)
class Progress:
    """One drone's answers to one command; `stage` is the furthest, None before the first; final: see `CommandAck`."""

    stage: AckStage | None = None
    reason: str = ""
    final: bool = False

    @property
    def settled(self) -> bool:
        """Return whether the last expected answer has arrived."""
        return self.stage in (AckStage.EFFECTIVE, AckStage.REFUSED)

    def text(self, final: bool = False) -> str:
        """Return the answers in words; a final text names what was never confirmed."""
        if self.stage is AckStage.REFUSED:
            return f"sent / received / refused: {self.reason}"
        reached = _ORDER[: _ORDER.index(self.stage) + 1] if self.stage else ()
        words = ["sent", *(stage.lower() for stage in reached)]
        if final and not self.settled:
            words.append(NOT_CONFIRMED)
        return " / ".join(words)


@dataclass(slots=True)
class AwaitedAnswers:
    """Collects the answers to one command from the drones that were addressed."""

    command: Command
    drones: tuple[str, ...]
    progress: dict[str, Progress] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.progress = {name: Progress() for name in self.drones}

    def note(self, ack: CommandAck) -> bool:
        """Take an answer; returns whether it is news. Answers to other commands and of strangers are ignored."""
        progress = self.progress.get(ack.header.entity)
        if progress is None or ack.command_id != self.command.id or progress.settled:
            return False
        known = -1 if progress.stage is None else _ORDER.index(progress.stage)
        if ack.stage is not AckStage.REFUSED and _ORDER.index(ack.stage) <= known:
            return False
        progress.stage, progress.reason, progress.final = ack.stage, ack.reason, ack.final
        return True

    def leave_out(self, drones: Collection[str], why: str) -> tuple[str, ...]:
        """Let the command go on without some drones, which count as having refused it; returns the others.

        If there are no others, the command stays as it is: an empty scope would address all.
        """
        for name, progress in self.progress.items():
            if name in drones and not progress.settled:
                progress.stage, progress.reason = AckStage.REFUSED, why
        others = tuple(name for name in self.command.scope or self.drones if name not in drones)
        if others:
            self.command = structs.replace(self.command, scope=others)
        return others

    @property
    def unheard(self) -> tuple[str, ...]:
        """Return the drones that have not answered at all."""
        return tuple(name for name, progress in self.progress.items() if progress.stage is None)

    @property
    def repeat_after_s(self) -> float:
        """Return how long to wait for the next answer before the command is sent again under the same id.

        Any single message may be lost on this bus; a drone that has the command answers a repetition with its last
        answer. An unheard stop is repeated as soon as an answer would have come on a busy machine.
        """
        if not self.unheard:
            return 1.0
        return 0.1 if self.command.verb.stops else 0.3

    @property
    def settled(self) -> bool:
        """Return whether all answers are final."""
        return all(progress.settled for progress in self.progress.values())

    @property
    def confirmed(self) -> bool:
        """Return whether the command took effect on every drone."""
        return all(progress.stage is AckStage.EFFECTIVE for progress in self.progress.values())
