"""`groundstation deadman`: hold a key or a gamepad's button; let go, and the drones hold, then land."""

import os
import select
import signal
import stat
import struct
import sys
import termios
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import click

from groundstation.bus.messages import RUN, CommandAck, Event, Lease, Verb
from groundstation.bus.roles import Role
from groundstation.bus.topics import COMMAND_ACK, EVENT, LEASE
from groundstation.cli.exits import ExitCode, UnreachableError
from groundstation.cli.stop import choose_run
from groundstation.console.commands import CommandDesk, Given
from groundstation.console.dead_man import DeadMan, Grip
from groundstation.errors import GroundStationError, OperatorMistake
from groundstation.supervisor.joining import join
from groundstation.supervisor.runtime_file import RuntimeRecord
from groundstation.time_units import NEVER_NS, NS_PER_MS, NS_PER_S

if TYPE_CHECKING:
    from groundstation.bus.api import Bus

_ME = "deadman"
_TURN_S = 0.02
_FAREWELL_NS = 2 * NS_PER_S
_LOST_NS = 10 * NS_PER_S  # longer than from letting go to LAND, which may still arrive
_KEYBOARD_PATIENCE_NS = 900 * NS_PER_MS
_GAMEPAD_PATIENCE_NS = NEVER_NS  # it reports its release
# WIRE: linux/joystick.h js_event: time u32, value s16, type u8 (1 = button, 0x80 = present state), number u8.
_EVENT = struct.Struct("<IhBB")
_BUTTON, _PRESENT = 0x01, 0x80
_LAND_BUTTON = 1


@dataclass(slots=True)
class Handle:
    """Source of the grip: a terminal (any repeating space) or a gamepad (any button but the second).

    pressed: those buttons; gone: it can no longer be held, the drones land; left: its user leaves, the drones hold.
    """

    descriptor: int
    gamepad: bool
    gone: bool = False
    left: bool = False
    pressed: set[int] = field(default_factory=set)

    def feel(self, man: DeadMan, now_ns: int) -> tuple[Verb | None, bool]:
        """Read the input; return the stop that it asks for, and whether no further one will follow."""
        if self.gone or self.left:
            time.sleep(_TURN_S)
            asked = man.release(now_ns)
            return asked, self.left or man.grip is not Grip.LOOSE
        if not select.select([self.descriptor], [], [], _TURN_S)[0]:
            return None, False
        try:
            data = os.read(self.descriptor, 512)
        except OSError:
            data = b""
        if not data:
            self.gone = True  # unplugged, or the terminal is gone
            return None, False
        return self._buttons(man, data, now_ns) if self.gamepad else self._keys(man, data, now_ns)

    def _keys(self, man: DeadMan, data: bytes, now_ns: int) -> tuple[Verb | None, bool]:
        if b"l" in data.lower():
            return man.land(), False
        if b"q" in data.lower() or b"\x03" in data:
            return man.release(now_ns), True
        if b" " in data:
            man.press(now_ns)
        return None, False

    def _buttons(self, man: DeadMan, data: bytes, now_ns: int) -> tuple[Verb | None, bool]:
        asked: Verb | None = None
        for _, value, kind, number in _EVENT.iter_unpack(data[: len(data) // _EVENT.size * _EVENT.size]):
            # The present state comes when the device is opened (a button that is down then was not pressed for us), and
            # in place of events that were lost because more than 64 waited (a release or LAND may be among them).
            told = bool(kind & _PRESENT)
            if kind & ~_PRESENT != _BUTTON:
                continue
            if number == _LAND_BUTTON:
                if value and (not told or man.grip is not Grip.DISARMED):
                    return man.land(), False
            elif value and not told:
                self.pressed.add(number)
                man.press(now_ns)
            elif not value and (not told or number in self.pressed):
                self.pressed.discard(number)
                asked = man.release(now_ns) or asked
        return asked, False


@click.command(epilog="\b\nExamples:\n  groundstation deadman\n  groundstation deadman --gamepad /dev/input/js0")
@click.option("--run", "name", metavar="NAME", help="The run to address, if there are several.")
@click.option("--gamepad", type=click.Path(exists=True), help="A joystick device (default: the space bar).")
def deadman(name: str | None, gamepad: str | None) -> int:
    """Dead man's handle: while it is held, the drones fly on. Let go, and they hold (space bar: after 0.9 s); 5 s later
    they land.

    An unplugged gamepad or a closed terminal counts as letting go; Ctrl-C, Ctrl-Z and q hold and leave. If the run ends
    while it is held, the exit code is 3. It is no emergency stop.
    """
    record = choose_run(name, stops=True)
    bus = join(record, "deadman", Role.CLI)
    grip = "any button (the second lands)" if gamepad else "the space bar"
    click.echo(f"{record.name}: hold {grip}. Let go: HOLD, 5 s later LAND. l: LAND now. q: HOLD and leave.")
    try:
        with _opened(gamepad) as handle:
            patience_ns = _GAMEPAD_PATIENCE_NS if handle.gamepad else _KEYBOARD_PATIENCE_NS
            heed_signals(handle)
            man = DeadMan(patience_ns)
            left = watch(bus, record.drones, handle, man, sign_of_life(record, bus))
    finally:
        bus.close()
    if not left:
        ended = f"{record.name}: the run has ended: this handle stops nothing"
        if man.grip is Grip.HELD:
            raise UnreachableError(ended)
        _show(f"{ended}\n")
    return ExitCode.OK


def sign_of_life(record: RuntimeRecord, bus: "Bus") -> Callable[[], bool]:
    """Return how to ask whether a run goes on: by its supervisor, or on another host by the operator's leases.

    The latter raises UnreachableError when the link may have broken: nobody may believe to hold the handle then.
    """
    if not record.host:
        return lambda: record.supervisor.alive
    leases, events = bus.subscribe([LEASE], newest=True), bus.subscribe([EVENT], entity=RUN)
    heard_ns = time.monotonic_ns()

    def goes_on() -> bool:
        nonlocal heard_ns
        now_ns = time.monotonic_ns()
        said = [received.message for received in leases.drain()]
        if any(isinstance(lease, Lease) and lease.run == record.run_dir for lease in said):
            heard_ns = now_ns  # drivers obey no orders for another run, which may have begun meanwhile
        if now_ns - heard_ns > _LOST_NS:
            text = f"{record.name}: nothing was heard of it for {_LOST_NS // NS_PER_S} s; it has ended, or the link has"
            raise UnreachableError(text)
        told = [received.message for received in events.drain()]
        return not any(isinstance(event, Event) and event.ends_run for event in told)

    return goes_on


def heed_signals(handle: Handle) -> None:
    """Let Ctrl-C leave as `q` does, and a closed terminal or the end of this process let go; main thread only.

    Ctrl-Z and Ctrl-\\ leave as well: a stopped or dead process orders nothing when the handle is let go.
    """

    def leave(_number: int, _frame: object) -> None:
        handle.left = True

    def lose(_number: int, _frame: object) -> None:
        handle.gone = True

    for number in (signal.SIGINT, signal.SIGTSTP, signal.SIGQUIT):
        signal.signal(number, leave)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lose)
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)  # in the background its output would stop it


def watch(bus: "Bus", drones: tuple[str, ...], handle: Handle, man: DeadMan, go_on: Callable[[], bool]) -> bool:
    """Obey the handle until the user leaves and the last order is settled, or until `go_on` returns False.

    Returns whether the user left.
    """
    desk, answers = CommandDesk(bus, drones), bus.subscribe([COMMAND_ACK])
    shown, left_ns, left = "", 0, False
    while go_on():
        now_ns = time.monotonic_ns()
        if left_ns:
            time.sleep(_TURN_S)
            left = now_ns - left_ns > _FAREWELL_NS or _settled(desk)
            if left:
                break
        else:
            asked, leaves = handle.feel(man, now_ns)
            verb = asked or man.step(now_ns)
            if verb is not None:
                desk.give(verb, (), Given(_ME), now_ns)
            left_ns = now_ns if leaves else 0
        for received in answers.drain():
            if isinstance(received.message, CommandAck):
                desk.take(received.message, now_ns)
        desk.step(now_ns)
        line = _line(desk, man)
        if line != shown:
            shown = line
            _show(f"\r{line:<78}")
    _show("\n")
    return left


def _show(text: str) -> None:
    with suppress(OSError):  # the terminal is gone; due orders are sent all the same
        click.echo(text, nl=False)


def _settled(desk: CommandDesk) -> bool:
    return all(order["state"] not in ("sent", "heard") for order in desk.summary() if order["by"] == _ME)


def _line(desk: CommandDesk, man: DeadMan) -> str:
    words = {"sent": "NOT CONFIRMED", "heard": "acknowledged", "not_confirmed": "NOT CONFIRMED"}
    orders = [f"{o['verb']} {words.get(o['state'], o['state'])}" for o in desk.summary() if o["by"] == _ME]
    grip = {Grip.DISARMED: "not armed: hold it", Grip.HELD: "held", Grip.LOOSE: "LET GO", Grip.LANDED: "landing"}
    return "  ".join([grip[man.grip], *orders[:1]])


def _joystick(path: str) -> int:
    """Return the open device; raises GroundStationError if it cannot be opened as one."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError as error:
        raise GroundStationError(f"cannot read {path}: {error.strerror} (is this user in the group input?)") from error
    if not stat.S_ISCHR(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise GroundStationError(f"{path} is no gamepad: joysticks are /dev/input/js0 and the next")
    os.set_blocking(descriptor, True)  # only opening must not wait, as that of a pipe would
    return descriptor


@contextmanager
def _opened(gamepad: str | None) -> Iterator[Handle]:
    if gamepad is not None:
        descriptor = _joystick(gamepad)
        try:
            with _terminal(of_keys=False):
                yield Handle(descriptor, gamepad=True)
        finally:
            os.close(descriptor)
        return
    if not sys.stdin.isatty():
        raise OperatorMistake("no keyboard here: run it in a terminal, or give --gamepad")
    with _terminal(of_keys=True):
        yield Handle(sys.stdin.fileno(), gamepad=False)


@contextmanager
def _terminal(*, of_keys: bool) -> Iterator[None]:
    """Take each key as it comes, if keys are wanted; Ctrl-S stops no output, in which orders would wait as well."""
    if not sys.stdin.isatty():
        yield
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    try:
        if of_keys:
            tty.setcbreak(descriptor)
        mode = termios.tcgetattr(descriptor)
        mode[tty.IFLAG] &= ~termios.IXON
        termios.tcsetattr(descriptor, termios.TCSANOW, mode)
        yield
    finally:
        with suppress(termios.error):  # the terminal is gone
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)
