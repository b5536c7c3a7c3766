"""The processes that a start waits for, the time limits, and the operator's messages meanwhile."""

from groundstation.process.heartbeat import SlotState
from groundstation.supervisor.managed_process import ManagedProcess

_NOTE_PERIOD_S = 2.0
_SAME_NOTE_PERIOD_S = 10.0
_TO_BEGIN = 8.0


class Waiting:
    """Processes that are not up yet.

    Each may take its own start limit from `began_s` on, over all restarts. grace_s: for processes not required; from
    when each first came up or failed, the start waits this long for READY, as a device may answer a moment after its
    driver begins. A process that does not begin at all has eight times as long: on a full machine the imports of a
    second run take 10 s and more.
    """

    def __init__(self, processes: list[ManagedProcess], began_s: float, grace_s: float | None = None) -> None:
        self.processes = list(processes)
        self._began_s = self._noted_s = began_s
        self._grace_s = grace_s
        self._begun_s: dict[str, float] = {}
        self._noted = ""
        self._seen_up: list[tuple[ManagedProcess, int]] = []

    def take_up(self) -> list[ManagedProcess]:
        """Return the processes up now and at the last call: one that dies of its first work is not up."""
        before = self._seen_up
        self._seen_up = [(process, process.life) for process in self.processes if self._is_up(process)]
        return self._take([process for process, life in self._seen_up if (process, life) in before])

    def take_late(self, now_s: float) -> list[ManagedProcess]:
        """Return the processes out of time; they are no longer waited for."""
        return self._take([process for process in self.processes if self._is_late(process, now_s)])

    def note(self, now_s: float) -> str:
        """Return a note of the awaited processes when the operator should read it (again), else ""."""
        note = ", ".join(_in_words(process) for process in self.processes)
        if now_s - self._noted_s <= (_SAME_NOTE_PERIOD_S if note == self._noted else _NOTE_PERIOD_S):
            return ""
        self._noted, self._noted_s = note, now_s
        return note

    def _is_up(self, process: ManagedProcess) -> bool:
        return process.is_up and (self._grace_s is None or process.state is SlotState.READY)

    def _is_late(self, process: ManagedProcess, now_s: float) -> bool:
        if self._grace_s is None:
            return now_s - self._began_s > process.spec.start_limit_s
        if not process.begins:
            return now_s - self._begun_s.setdefault(process.spec.name, now_s) > self._grace_s
        return now_s - self._began_s > _TO_BEGIN * self._grace_s

    def _take(self, processes: list[ManagedProcess]) -> list[ManagedProcess]:
        self.processes = [process for process in self.processes if process not in processes]
        return processes


def _in_words(process: ManagedProcess) -> str:
    state = "starting" if process.state is SlotState.EMPTY else process.state.name.lower()
    return f"{process.spec.name} ({process.detail or state})"
