"""One live process of the table: its handle, its lifecycle by the heartbeat block, its restarts."""

import os
import signal
import subprocess
from collections.abc import Callable
from contextlib import suppress

from groundstation.bus.messages import Lifecycle, ProcessStatus
from groundstation.process.heartbeat import HeartbeatBlock, SlotState
from groundstation.process.processor import all_waited_ns
from groundstation.supervisor.process_spec import ProcessSpec
from groundstation.supervisor.runtime_file import start_time
from groundstation.supervisor.silence import signs_of, silent_since
from groundstation.time_units import NS_PER_S

_BACK_OFF_S = (0.0, 0.5, 1.0, 2.0, 5.0)
_FORGIVEN_AFTER_NS = 30 * NS_PER_S
_STARVED_SHARE = 0.5  # of its silence; one that hangs or is stopped waits for no core
STORM_RESTARTS = 5


class ManagedProcess:
    """The supervisor's state of one process."""

    def __init__(self, spec: ProcessSpec, slot: int, block: HeartbeatBlock) -> None:
        self.spec = spec
        self.slot = slot
        self._block = block
        self._handle: subprocess.Popen[bytes] | None = None
        self.pidfd = -1
        self.pid = 0
        self.start_time = 0
        self.life = 0
        self.started_ns = 0
        self.ready_ns = 0
        self.restart_due_ns: int | None = None
        self.kill_reason = ""
        self.detail = self.farewell = ""
        self._left_when_told = False
        self._waited: tuple[int, int] | None = None
        self._failures = 0

    @property
    def running(self) -> bool:
        """Return whether it was started and its end has not been noticed yet."""
        return self._handle is not None

    @property
    def state(self) -> SlotState:
        """Return the lifecycle state that the process itself recorded."""
        return self._block.state(self.slot) if self.running else SlotState.EMPTY

    @property
    def is_up(self) -> bool:
        """Return whether its start is finished and it still runs."""
        return self.running and self.state in (SlotState.READY, SlotState.DEGRADED)

    @property
    def begins(self) -> bool:
        """Return whether it was started once, and is neither up nor dead yet."""
        return self.running and self.life == 1 and not self.is_up

    def adopt(self, handle: subprocess.Popen[bytes], now_ns: int) -> None:
        """Take over a process that was just started; ends it and raises OSError when it cannot be watched."""
        try:
            self.pidfd = os.pidfd_open(handle.pid)
        except OSError:
            handle.kill()
            handle.wait()
            raise
        self._handle = handle
        self.pid = handle.pid
        self.start_time = start_time(handle.pid) or 0
        self.life += 1
        self.started_ns, self.ready_ns = now_ns, 0
        self.restart_due_ns = None
        self.kill_reason = self.farewell = ""
        self.heard_again()

    def heard(self, status: ProcessStatus) -> None:
        """Keep the process's last status, and the reason of its end."""
        self.detail = status.detail
        self.farewell = status.detail if status.state is Lifecycle.STOPPING else ""

    def heartbeat_age_ns(self, now_ns: int) -> int:
        """Return the time since its last beat [ns]."""
        return self._block.age_ns(self.slot, now_ns)

    @property
    def silent_since_ns(self) -> int:
        """Since when others have sent for it [ns]; 0: nobody does. The guardian reads and may change it."""
        return self._block.silent_since_ns(self.slot)

    @silent_since_ns.setter
    def silent_since_ns(self, since_ns: int) -> None:
        self._block.set_silent_since(self.slot, since_ns)

    def judge_silence(self, now_ns: int, awake_since_ns: int, limit_ns: int, *, gone: bool = False) -> int:
        """Return since when it is silent [ns]; 0: it is not.

        awake_since_ns: since when its silence could be noticed.
        """
        signs = signs_of(self._block, self.slot, gone=gone)
        return silent_since(signs, self.silent_since_ns, now_ns, awake_since_ns, limit_ns)

    def starved(self, now_ns: int) -> bool:
        """Return whether its threads have mostly waited for a core since the first call after `heard_again`."""
        waited = all_waited_ns(self.pid)
        since_ns, before = self._waited = self._waited or (now_ns, waited)
        return waited - before > _STARVED_SHARE * (now_ns - since_ns)

    def heard_again(self) -> None:
        """Forget that it was silent."""
        self._waited = None

    def reap(self) -> int | None:
        """Return the exit code if the process has ended (negative: by that signal), and forget its handle."""
        if self._handle is None or not _has_ended(self.pid):
            return None
        if self.is_up and not self.ready_ns:
            self.ready_ns = self.started_ns  # it was up between two looks
        self.signal_group(signal.SIGKILL)  # its children end with it; its pid is still reserved here
        code = self._handle.wait()
        os.close(self.pidfd)
        self._handle, self.pidfd = None, -1
        self.silent_since_ns = self.judge_silence(0, 0, 0, gone=True)
        self._left_when_told = self._block.has_ended(self.slot)
        self._block.clear(self.slot)
        return code

    def end_text(self, code: int, logged: Callable[[str], str]) -> str:
        """Return how it ended, in words, after `reap`; logged: the reason in its log, if its last status is late."""
        if code == 0 and self.spec.failsafe_datagrams is not None and not self._left_when_told:
            return "ended without an order to"
        return self.kill_reason or exit_text(code, self.farewell or (logged(self.spec.name) if code > 0 else ""))

    def left_when_told(self) -> bool:
        """Return, once for each such end, whether it ended in order: during a run only a signal does that."""
        told, self._left_when_told = self._left_when_told, False
        return told

    def abandon(self) -> None:
        """Forget a process that even SIGKILL does not end; the kernel ends it when it can."""
        if self._handle is not None:
            os.close(self.pidfd)
            self._handle.returncode = -signal.SIGKILL  # else its destructor would complain
            self._handle, self.pidfd = None, -1

    def signal(self, number: int) -> None:
        """Signal the process, if it still runs."""
        if self._handle is not None:
            os.kill(self.pid, number)  # not reaped yet, so the pid is its own; Popen.send_signal would reap it

    def signal_group(self, number: int) -> None:
        """Signal the process and all that it started."""
        if self._handle is not None:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, number)

    def schedule_restart(self, now_ns: int) -> float:
        """Plan the next start, later after each failure in a row; returns the delay [s]."""
        if self.ready_ns and now_ns - self.ready_ns > _FORGIVEN_AFTER_NS:
            self._failures = 0
        delay_s = max(self.spec.restart_delay_s, _BACK_OFF_S[min(self._failures, len(_BACK_OFF_S) - 1)])
        self._failures += 1
        self.restart_due_ns = now_ns + int(delay_s * NS_PER_S)
        return delay_s

    @property
    def storms(self) -> bool:
        """Return whether it has failed so often in a row that trying on is unlikely to help."""
        return self._failures >= STORM_RESTARTS


def _has_ended(pid: int) -> bool:
    """Return whether a child of ours is a zombie, leaving it one so that its process group stays ours to signal."""
    try:
        return os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None
    except ChildProcessError:  # somebody else has waited for it: its exit code is lost, the run goes on
        return True


def exit_text(code: int, farewell: str = "") -> str:
    """Return an exit code in words, with the process's last text on a failure."""
    if code < 0:
        with suppress(ValueError):
            return f"killed by {signal.Signals(-code).name}"
    why = farewell.partition("\n")[0]
    return f"ended with code {code}: {why}" if code and why else f"ended with code {code}"
