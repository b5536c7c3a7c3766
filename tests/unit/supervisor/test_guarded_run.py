"""A run with its own bus: certificates from start to end, joining from another shell, refusals."""

import os
import signal
import stat
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from dummy_table import spec, start, until

from groundstation.bus.messages import Event
from groundstation.bus.roles import Role
from groundstation.bus.topics import EVENT, PROCESS_STATUS
from groundstation.bus.zenoh_bus import open_bus
from groundstation.errors import GroundStationError
from groundstation.supervisor import runtime_file
from groundstation.supervisor.joining import join
from groundstation.supervisor.supervisor import Supervisor


@pytest.fixture
def run(make: Callable[..., Supervisor]) -> Iterator[Supervisor]:
    supervisor = make(spec("drone_1", "obedient"), guarded=True)
    start(supervisor)
    yield supervisor


def test_members_meet_strangers_are_refused_and_named_and_nothing_is_left(run: Supervisor, tmp_path: Path) -> None:
    (record,) = runtime_file.live_records()
    folder = Path(record.identities)
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    with closing(join(record, "view", Role.VIEW)) as view:
        statuses, events = view.subscribe([PROCESS_STATUS], entity="drone_1"), view.subscribe([EVENT])
        until(run, lambda: statuses.waiting)
        for endpoint in (record.endpoint.replace("tls/", "tcp/"), record.endpoint):
            with pytest.raises(GroundStationError, match="no router answers"):
                open_bus(endpoint, "lab", "tracker", 0.0)
        told: list[str] = []

        def refusal_is_told() -> bool:
            told.extend(item.message.text for item in events.drain() if isinstance(item.message, Event))
            return any("refused" in text and "not of this run" in text for text in told)

        until(run, refusal_is_told)
    run.close()
    assert not folder.exists()


def test_members_come_back_to_a_restarted_router(run: Supervisor) -> None:
    router, (record,) = run.processes[0], runtime_file.live_records()
    statuses = join(record, "view", Role.VIEW)
    with closing(statuses):
        pid = router.pid
        os.kill(pid, signal.SIGKILL)
        until(run, lambda: router.is_up and router.pid != pid)
        inbox = statuses.subscribe([PROCESS_STATUS], entity="drone_1")
        until(run, lambda: inbox.waiting)


def test_certificates_of_a_killed_run_are_removed(run: Supervisor) -> None:
    (record,) = runtime_file.live_records()
    folder = Path(record.identities)
    runtime_file.remove(record)
    assert not folder.exists()
