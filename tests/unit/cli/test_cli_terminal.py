"""Terminals that get the live table."""

import os
import pty
import sys

import pytest

from groundstation.cli.terminal import can_be_drawn_on


@pytest.mark.parametrize(("kind", "drawn"), [("xterm-256color", True), ("dumb", False), ("unknown", False)])
def test_a_dumb_terminal_gets_plain_lines(monkeypatch: pytest.MonkeyPatch, kind: str, drawn: bool) -> None:
    operator, terminal = pty.openpty()
    with os.fdopen(terminal, "w") as stdout, os.fdopen(operator):
        monkeypatch.setenv("TERM", kind)
        with monkeypatch.context() as patched:
            patched.setattr(sys, "stdout", stdout)
            found = can_be_drawn_on()
    assert found is drawn
