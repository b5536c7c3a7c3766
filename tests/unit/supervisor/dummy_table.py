"""Rows of a process table whose children are dummies, and waits for their actions."""

import time
from collections.abc import Callable

from groundstation.supervisor.process_spec import ProcessSpec
from groundstation.supervisor.start import Start
from groundstation.supervisor.supervisor import Supervisor


def spec(name: str, entry: str, **options: object) -> ProcessSpec:
    return ProcessSpec(name, "driver", entry=f"dummies:{entry}", **options)  # type: ignore[arg-type]


def start(supervisor: Supervisor) -> None:
    Start(supervisor).run()


def until(supervisor: Supervisor, condition: Callable[[], bool], limit_s: float = 15.0) -> None:
    deadline = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < deadline, "never happened"
        supervisor.step()
