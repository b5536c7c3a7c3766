"""A program that only observes exits at one signal, whatever it is doing."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_BEGIN = """
import time
from groundstation.process.leaving import LeavingSignal, leave_within
leaving = LeavingSignal()
leaving.install()
print("ready", flush=True)
"""
# The interpreter ignores exceptions in a destructor, such as an interrupt that arrives there.
_IN_A_DESTRUCTOR = """
class Slow:
    def __del__(self):
        time.sleep(0.2)
while not leaving.requested:
    Slow()
"""
_LINK_HOLDS_ITS_CLOSE = "leave_within(0.5, 7)\ntime.sleep(60)\n"
_NATIVE_CODE_WAITS = "import threading\nthreading.Event().wait(60)\n"


@contextmanager
def _running(script: str) -> "Iterator[subprocess.Popen[str]]":
    with subprocess.Popen([sys.executable, "-c", _BEGIN + script], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.kill()


def test_an_interrupt_is_heard_where_an_exception_would_be_swallowed() -> None:
    with _running(_IN_A_DESTRUCTOR) as process:
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 0


def test_a_link_that_does_not_close_is_left() -> None:
    with _running(_LINK_HOLDS_ITS_CLOSE) as process:
        assert process.wait(10) == 7


def test_a_second_signal_ends_what_still_waits() -> None:
    with _running(_NATIVE_CODE_WAITS) as process:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(0.5)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGINT)
        assert process.wait(10) == -signal.SIGINT
