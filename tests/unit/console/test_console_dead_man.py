"""The dead man's handle: states, keys, gamepad bytes, and messages on the bus."""

import contextlib
import os
import pty
import signal
import struct
import sys
import termios
import time
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import RUN, RUN_ENDED, Command, Event, Lease, Severity, Verb
from groundstation.cli import deadman
from groundstation.cli.deadman import Handle, heed_signals, sign_of_life, watch
from groundstation.cli.exits import ExitCode, UnreachableError
from groundstation.console import dead_man
from groundstation.console.dead_man import DeadMan, Grip
from groundstation.errors import GroundStationError
from groundstation.supervisor.runtime_file import ProcessRecord, RuntimeRecord
from groundstation.time_units import NS_PER_S


def test_it_does_nothing_before_it_is_held() -> None:
    man = DeadMan(NS_PER_S)
    assert [man.step(k * NS_PER_S) for k in range(100)] == [None] * 100


def test_let_go_it_holds_and_then_lands_once() -> None:
    man = DeadMan(NS_PER_S)
    man.press(10 * NS_PER_S)
    assert man.step(11 * NS_PER_S) is None
    assert man.step(11 * NS_PER_S + 1) is Verb.HOLD
    assert man.step(12 * NS_PER_S) is None
    assert man.step(17 * NS_PER_S) is Verb.LAND
    assert man.step(90 * NS_PER_S) is None and man.grip is Grip.LANDED


def test_held_again_in_time_it_does_not_land() -> None:
    man = DeadMan(NS_PER_S)
    man.press(0)
    assert man.release(1) is Verb.HOLD
    assert man.release(2) is None
    man.press(3 * NS_PER_S)
    assert man.step(4 * NS_PER_S) is None and man.grip is Grip.HELD


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    ends = os.pipe()
    yield ends
    for end in ends:
        with contextlib.suppress(OSError):
            os.close(end)


def button(number: int, value: int, kind: int = 1) -> bytes:
    return struct.pack("<IhBB", 0, value, kind, number)


@pytest.mark.parametrize(
    ("data", "grip", "verb", "leaves"),
    [
        (b"   ", Grip.HELD, None, False),
        (b"x", Grip.DISARMED, None, False),
        (b" l", Grip.LANDED, Verb.LAND, False),
        (b"q", Grip.DISARMED, None, True),
    ],
)
def test_keys(pipe: tuple[int, int], data: bytes, grip: Grip, verb: Verb | None, leaves: bool) -> None:
    man = DeadMan(NS_PER_S)
    os.write(pipe[1], data)
    assert Handle(pipe[0], gamepad=False).feel(man, 5) == (verb, leaves)
    assert man.grip is grip


def test_gamepad(pipe: tuple[int, int]) -> None:
    man, handle = DeadMan(1 << 62), Handle(pipe[0], gamepad=True)

    def feel(*events: bytes) -> tuple[Verb | None, Grip]:
        os.write(pipe[1], b"".join(events))
        return handle.feel(man, 5)[0], man.grip

    state_at_first = [button(5, 1, kind=0x81), button(1, 1, kind=0x81), button(0, 0, kind=0x81)]
    assert feel(*state_at_first, button(0, 300, kind=2)) == (None, Grip.DISARMED)
    assert feel(button(5, 1)) == (None, Grip.HELD)
    assert feel(button(5, 0))[0] is Verb.HOLD
    assert feel(button(5, 1), button(1, 1))[0] is Verb.LAND
    man.press(5)
    os.close(pipe[1])  # pulled out
    assert [handle.feel(man, 6) for _ in range(3)] == [(None, False), (Verb.HOLD, False), (None, False)]
    assert man.step(6 * NS_PER_S) is Verb.LAND and handle.feel(man, 6 * NS_PER_S) == (None, True)


@pytest.mark.parametrize(
    ("state", "verb", "grip"),
    [
        ({5: 1, 0: 0}, None, Grip.HELD),
        ({5: 0, 0: 1}, Verb.HOLD, Grip.LOOSE),
        ({5: 1, 1: 1}, Verb.LAND, Grip.LANDED),
    ],
)
def test_a_release_among_lost_events_shows_in_the_state_told_instead(
    pipe: tuple[int, int], state: dict[int, int], verb: Verb | None, grip: Grip
) -> None:
    """Linux drops all events of a joystick when more than 64 wait."""
    man, handle = DeadMan(1 << 62), Handle(pipe[0], gamepad=True)
    os.write(pipe[1], button(5, 1))
    handle.feel(man, 5)
    os.write(pipe[1], b"".join(button(*one, kind=0x81) for one in state.items()) + button(0, 9, kind=0x82))
    assert (handle.feel(man, 6)[0], man.grip) == (verb, grip)


def test_it_goes_out_to_everybody_and_is_repeated(pipe: tuple[int, int]) -> None:
    exchange = MemoryExchange()
    bus, drone = MemoryBus(exchange, "lab", "deadman_1"), MemoryBus(exchange, "lab", "drone_1")
    commands = drone.subscribe([t.COMMAND])
    os.write(pipe[1], b" q")
    man = DeadMan(NS_PER_S)
    man.press(time.monotonic_ns())
    began = time.monotonic()
    watch(bus, ("drone_1",), Handle(pipe[0], gamepad=False), man, lambda: time.monotonic() - began < 0.8)
    sent = [received.message for received in commands.drain()]
    assert len(sent) >= 2
    assert all(isinstance(c, Command) and c.verb is Verb.HOLD and c.scope == () for c in sent)


def test_on_another_host_it_lasts_as_long_as_the_operators_leases(
    pipe: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """There the supervisor's process cannot be looked at."""
    monkeypatch.setattr(deadman, "_LOST_NS", NS_PER_S // 2)
    exchange = MemoryExchange()
    bus, operator = MemoryBus(exchange, "lab", "deadman_laptop_1"), MemoryBus(exchange, "lab", "operator")
    drone = MemoryBus(exchange, "lab", "drone_1")
    commands = drone.subscribe([t.COMMAND])
    record = RuntimeRecord("lab", "", "", "run-7", "", ("drone_1",), ProcessRecord("", "", 0, 0), (), host="laptop")
    alive, began = sign_of_life(record, bus), time.monotonic()

    def goes_on() -> bool:
        header = operator.header("team")
        of_run = "run-7" if time.monotonic() - began < 1.0 else "run-8"  # then another one
        operator.publish(t.LEASE, Lease(header=header, holder="operator", expires_ns=1, run=of_run))
        return alive()

    man = DeadMan(NS_PER_S // 5)
    man.press(time.monotonic_ns())
    with pytest.raises(UnreachableError, match="lab: nothing was heard of it"):
        watch(bus, record.drones, Handle(pipe[0], gamepad=False), man, goes_on)
    assert 1.4 < time.monotonic() - began < 3.0
    verbs = [one.message.verb for one in commands.drain() if isinstance(one.message, Command)]
    assert verbs and set(verbs) == {Verb.HOLD}


def test_on_another_host_it_ends_with_the_run() -> None:
    exchange = MemoryExchange()
    bus, supervisor = MemoryBus(exchange, "lab", "deadman_1"), MemoryBus(exchange, "lab", "supervisor")
    record = RuntimeRecord("lab", "", "", "run-7", "", ("drone_1",), ProcessRecord("", "", 0, 0), (), host="laptop")
    alive = sign_of_life(record, bus)
    assert alive()
    end = Event(header=supervisor.header(RUN), severity=Severity.INFO, text=f"{RUN_ENDED}stopped by the operator")
    supervisor.publish(t.EVENT, end)
    assert not alive()


@pytest.mark.parametrize(("keys", "held"), [(b" ", True), (b"x", False), (b" l", False)])
def test_a_run_that_ends_is_told_and_is_an_error_while_it_is_held(
    pipe: tuple[int, int], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], keys: bytes, held: bool
) -> None:
    record = RuntimeRecord("lab", "", "", "run-7", "", ("drone_1",), ProcessRecord("", "", 0, 0), ())
    turns = iter([True, True, True, False])
    monkeypatch.setattr(deadman, "choose_run", lambda *_, **__: record)
    monkeypatch.setattr(deadman, "join", lambda *_: MemoryBus(MemoryExchange(), "lab", "deadman_1"))
    monkeypatch.setattr(deadman, "sign_of_life", lambda *_: lambda: next(turns))
    monkeypatch.setattr(deadman, "_opened", lambda _: contextlib.nullcontext(Handle(pipe[0], gamepad=False)))
    monkeypatch.setattr(deadman, "heed_signals", lambda _: None)
    os.write(pipe[1], keys)
    if held:
        with pytest.raises(UnreachableError, match="the run has ended: this handle stops nothing"):
            deadman.deadman.main([], standalone_mode=False)
    else:
        assert deadman.deadman.main([], standalone_mode=False) == ExitCode.OK
        assert capsys.readouterr().out.endswith("the run has ended: this handle stops nothing\n")


@pytest.mark.parametrize(
    ("number", "orders"),
    [
        (signal.SIGINT, [Verb.HOLD]),
        (signal.SIGTSTP, [Verb.HOLD]),
        (signal.SIGQUIT, [Verb.HOLD]),
        (signal.SIGTERM, [Verb.HOLD, Verb.LAND]),
        (signal.SIGHUP, [Verb.HOLD, Verb.LAND]),
    ],
)
def test_no_signal_takes_the_handle_away_without_a_stop(
    pipe: tuple[int, int], monkeypatch: pytest.MonkeyPatch, number: signal.Signals, orders: list[Verb]
) -> None:
    monkeypatch.setattr(dead_man, "_LAND_AFTER_NS", NS_PER_S // 5)
    monkeypatch.setattr(deadman, "_FAREWELL_NS", NS_PER_S // 5)
    monkeypatch.setattr(click, "echo", broken)
    exchange = MemoryExchange()
    bus, drone = MemoryBus(exchange, "lab", "deadman_1"), MemoryBus(exchange, "lab", "drone_1")
    commands = drone.subscribe([t.COMMAND])
    taken = (signal.SIGINT, signal.SIGTSTP, signal.SIGQUIT, signal.SIGTERM, signal.SIGHUP, signal.SIGTTOU)
    before = {each: signal.getsignal(each) for each in taken}
    handle, man, began = Handle(pipe[0], gamepad=True), DeadMan(1 << 62), time.monotonic()
    man.press(time.monotonic_ns())
    try:
        heed_signals(handle)
        os.kill(os.getpid(), number)
        watch(bus, ("drone_1",), handle, man, lambda: time.monotonic() - began < 5.0)
    finally:
        for each, action in before.items():
            signal.signal(each, action)
    assert time.monotonic() - began < 4.0, "it left by itself"
    verbs = [one.message.verb for one in commands.drain() if isinstance(one.message, Command)]
    assert list(dict.fromkeys(verbs)) == orders


@pytest.mark.parametrize("gamepad", [None, "/dev/null"])
def test_ctrl_s_holds_back_no_order(monkeypatch: pytest.MonkeyPatch, gamepad: str | None) -> None:
    operator, terminal = pty.openpty()
    before = termios.tcgetattr(terminal)
    with os.fdopen(terminal) as stdin, os.fdopen(operator):
        monkeypatch.setattr(sys, "stdin", stdin)
        with deadman._opened(gamepad):
            assert not termios.tcgetattr(terminal)[0] & termios.IXON
            assert bool(termios.tcgetattr(terminal)[3] & termios.ICANON) == (gamepad is not None)
        assert termios.tcgetattr(terminal) == before


def broken(*_: object, **__: object) -> None:
    raise OSError("the terminal is gone")


def test_files_that_are_no_gamepad_are_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("no joystick")
    for path, words in (
        (tmp_path / "notes.txt", "no gamepad"),
        (tmp_path, "no gamepad"),
        (tmp_path / "js9", "No such file"),
    ):
        with pytest.raises(GroundStationError, match=words), deadman._opened(str(path)):
            pass
    with deadman._opened("/dev/null") as handle:
        assert handle.gamepad
        man = DeadMan(1)
        man.press(0)
        assert [handle.feel(man, 1)[0] for _ in range(2)] == [None, Verb.HOLD]  # as good as unplugged
