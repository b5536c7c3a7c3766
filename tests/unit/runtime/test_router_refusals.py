"""Operator warnings from the router's log lines about refused connections."""

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from groundstation.runtime.router_refusals import RouterRefusals

S = 1_000_000_000
HEAD = "2026-11-21T16:58:00Z TRACE rx-0 ThreadId(09) zenoh::net::routing::interceptor::access_control: "
DRONE = "c624 on Interface(lo)+CertCommonName(drone_1)+Transport(Tls)+c624"
KEY = "gs/@v1/lab/drone_2/setpoint/tracker"
STRANGER = "2026-11-21T16:58:00Z  WARN acc-0 ThreadId(05) zenoh_link_tls::unicast: tls handshake eof\n"


@contextmanager
def reading() -> Iterator[RouterRefusals]:
    """Within a test only: pytest redirects standard output itself between its phases."""
    refusals = RouterRefusals()
    try:
        yield refusals
    finally:
        refusals.close()


@pytest.fixture(autouse=True)
def colours(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")


def denied(who: str, key: str, what: str = "Put") -> str:
    return f"{HEAD}{who} is unauthorized to {what} (ingress) on {key}\n"


def declared(who: str, key: str) -> str:
    """Text written when a key is declared, by a subscriber too."""
    return "".join(denied(who, key, what) for what in ("Query", "Reply", "Put", "Delete"))


def say(*lines: str) -> None:
    os.write(1, "".join(lines).encode())


def test_a_key_put_without_declaring_it_is_named() -> None:
    with reading() as refusals:
        say(f"{HEAD}{DRONE} is authorized to Put (ingress) on {KEY}\n", denied(DRONE, KEY))
        assert refusals.take(S) == [
            "the bus refused messages of drone_1: it may not publish setpoint of drone_2 as tracker"
        ]
        assert refusals.take(2 * S) == []


def test_a_refused_declaration_is_reported_only_with_a_refused_message() -> None:
    with reading() as refusals:
        say(declared(DRONE, KEY))
        assert refusals.take(S) == []
        say(denied("Using cached result: c624", KEY))
        assert refusals.take(2 * S) == [
            "the bus refused messages of drone_1: it may not publish setpoint of drone_2 as tracker"
        ]


def test_a_block_that_comes_in_two_readings_accuses_nobody() -> None:
    with reading() as refusals:
        block = declared(DRONE, KEY)
        middle = block.index("unauthorized to Put")
        say(block[:middle])
        assert refusals.take(S) == []
        say(block[middle:])
        assert refusals.take(2 * S) == []


def test_each_is_told_of_once_in_ten_seconds() -> None:
    with reading() as refusals:
        other = DRONE.replace("c624", "99ab").replace("drone_1", "cli-shell")
        told = []
        for second in range(1, 21):
            say(*[denied(DRONE, KEY)] * 50, denied(other, KEY) if second == 3 else "")
            told += [(second, text.split(":")[0].split()[-1]) for text in refusals.take(second * S)]
        assert told == [(1, "drone_1"), (3, "cli-shell"), (11, "drone_1")]


def test_a_key_of_nobodys_making_is_not_repeated() -> None:
    with reading() as refusals:
        say(denied(DRONE, "\x1b[2J/gs"), f"{HEAD}is unauthorized to Put (ingress) on {KEY}\n")
        (text,) = refusals.take(S)
        assert (
            text
            == "the bus refused messages of drone_1: it may not publish under a key that is not in the table of topics"
        )


def test_strangers_are_counted_and_what_goes_wrong_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    with reading() as refusals:
        caplog.set_level(logging.WARNING)
        say(*[STRANGER] * 30, "2026-11-21T16:58:00Z ERROR acc-0 zenoh: something else\n")
        assert refusals.take(S) == ["the bus refused 30 connections of programs that are not of this run"]
        say(STRANGER)
        assert refusals.take(2 * S) == []
        say(STRANGER)
        assert refusals.take(12 * S) == ["the bus refused 2 connections of programs that are not of this run"]
        assert len(caplog.records) == 20, "a flood does not fill the disk"
