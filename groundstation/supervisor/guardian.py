"""The guardian process: stops and lands drones that have lost both their driver and the supervisor.

It holds the prepared datagrams, reads the heartbeat block, and needs neither bus nor router. It starts first and stops
last; without a supervisor it ends by itself once LAND has been sent to every drone for long enough.
"""

import logging
import os
import select
import signal
import time
from contextlib import suppress
from functools import partial

import msgspec

from groundstation.process.child import Child
from groundstation.process.heartbeat import SUPERVISOR_SLOT, HeartbeatBlock, SlotState
from groundstation.process.priority import go_first
from groundstation.supervisor.failsafe_sender import FailsafeSender, Speaker, unreachable
from groundstation.supervisor.guard_order import GuardOrder, Post
from groundstation.supervisor.silence import (
    DriverSigns,
    FailsafeCommand,
    Guard,
    SupervisorSigns,
    SupervisorState,
    signs_of,
)
from groundstation.time_units import NS_PER_MS

_PERIOD_NS = 40 * NS_PER_MS
_OWN_DELAY_NS = 200 * NS_PER_MS
_log = logging.getLogger(__name__)


class GuardedDriver:
    """A driver's process as the guardian sees it; its pidfd cannot be fooled by a reused pid."""

    def __init__(self, post: Post, landing_s: float, block: HeartbeatBlock) -> None:
        self.post = post
        self.guard = Guard(post.words.land_after_s, landing_s)
        self._block = block
        self._pid, self._pidfd = 0, -1

    def signs(self) -> DriverSigns:
        """Return the present signs of life by heartbeat block and kernel."""
        slot, block = self.post.slot, self._block
        if block.pid(slot) != self._pid:
            self._follow(block.pid(slot))
        gone = bool(self._pid) and (self._pidfd < 0 or bool(select.select([self._pidfd], (), (), 0)[0]))
        return signs_of(block, slot, gone=gone)

    def _follow(self, pid: int) -> None:
        self.close()
        self._pid = pid
        if pid:
            try:
                self._pidfd = os.pidfd_open(pid)
            except ProcessLookupError:
                self._pidfd = -1

    def kill(self) -> None:
        """Kill a hanging process, so that it cannot wake up and send contradicting orders."""
        if self._pidfd >= 0:
            with suppress(ProcessLookupError):  # it has ended meanwhile
                signal.pidfd_send_signal(self._pidfd, signal.SIGKILL)

    def close(self) -> None:
        """Release the descriptor; idempotent."""
        if self._pidfd >= 0:
            os.close(self._pidfd)
        self._pid, self._pidfd = 0, -1


class Guardian:
    """Watches all drivers and sends for a drone when no other process does."""

    def __init__(self, order: GuardOrder, block: HeartbeatBlock) -> None:
        self._block = block
        self._drivers = [GuardedDriver(post, order.landing_s, block) for post in order.posts]
        self._sender = FailsafeSender(Speaker.GUARDIAN)
        self.speechless = {
            post.name: why for post in order.posts if (why := self._sender.prepare(post.name, post.words))
        }
        self._turn_ns = self._awake_since_ns = time.monotonic_ns()
        self.settled = False

    def turn(self, now_ns: int, supervisor: SupervisorSigns) -> None:
        """Look after every drone once."""
        if now_ns - self._turn_ns > _OWN_DELAY_NS:
            self._awake_since_ns = now_ns  # the guardian was frozen itself: earlier silence of others does not count
        self._turn_ns = now_ns
        settled = [self._look_after(driver, now_ns, supervisor) for driver in self._drivers]
        self.settled = all(settled)
        self._sender.send_due(now_ns)

    def _look_after(self, driver: GuardedDriver, now_ns: int, supervisor: SupervisorSigns) -> bool:
        post, slot = driver.post, driver.post.slot
        before_ns = self._block.silent_since_ns(slot)
        decision = driver.guard.step(now_ns, driver.signs(), before_ns, supervisor, self._awake_since_ns)
        supervised = supervisor.state(now_ns) is SupervisorState.SPEAKS
        if decision.command is FailsafeCommand.NONE:
            if self._sender.end(post.name):
                _log.info("%s: the word is %s", post.name, "the supervisor's" if supervised else "the driver's")
        elif self._sender.begin(
            post.name,
            post.words,
            decision.since_ns,
            partial(self._block.addresses, slot),
            partial(self._block.left, slot),
        ):
            _log.warning("%s is silent, and so is the supervisor: its drone is told to hover, then to land", post.name)
        if decision.since_ns != before_ns:
            self._block.set_silent_since(slot, decision.since_ns)
        if decision.kill:
            _log.warning("%s hangs: killed", post.name)
            driver.kill()
        return decision.settled

    def close(self) -> None:
        """Stop sending; idempotent."""
        self._sender.close()
        for driver in self._drivers:
            driver.close()


def run(child: Child) -> int:
    """Guard until the run has ended and no drone needs a guardian; the process entry."""
    order = msgspec.json.decode(child.section, type=GuardOrder)
    block = HeartbeatBlock.attach(child.spec.heartbeat)
    guardian = Guardian(order, block)
    go_first()
    names = ", ".join(post.name for post in order.posts)
    missing = "; ".join(unreachable(name, why) for name, why in guardian.speechless.items())
    if missing:
        child.degrade(missing)
    else:
        child.ready(names)
    while True:
        now_ns = time.monotonic_ns()
        stops = block.state(SUPERVISOR_SLOT) is SlotState.STOPPING
        supervisor = SupervisorSigns(block.beat_ns(SUPERVISOR_SLOT), child.supervisor_alive, stops)
        guardian.turn(now_ns, supervisor)
        child.beat()
        if guardian.settled and (child.stop_requested or not child.supervisor_alive):
            break
        child.sleep_until(now_ns + _PERIOD_NS)
    guardian.close()
    block.close(remove=not child.supervisor_alive)  # the last to leave
    return 0
