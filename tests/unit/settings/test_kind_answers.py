"""What a foreign kind's vehicles fly and stop by is refused before a flight if it would first fail in an emergency."""

import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from installation import install

from groundstation.cli import main as cli
from groundstation.cli.exits import ExitCode
from groundstation.errors import SettingsError
from groundstation.flight.composition import process_table
from groundstation.settings.load import load_field
from groundstation.vehicles import StopDatagrams, all_kinds, registry
from groundstation.vehicles.answers import processes_of, stop_of
from sim_bridge.conformance.check import CHECKS
from sim_bridge.conformance.kit import Kit

LAB = Path(__file__).parents[3] / "config/mixed-team.yaml"
OPTIONS = ["drones.drone_3.kind=blimp", "drones.drone_3.mavlink=null", "types.ardupilot.mavlink=null"]
KIND = """
from groundstation.vehicles import DriverProcess, ErrorHabits, StopDatagrams, VehicleKind

KIND = VehicleKind(
    name="blimp",
    summary="a blimp",
    driver="blimp_driver:run",
    habits=ErrorHabits(1.0, 1.0, 1.0, 0.1, 0.0, True, True),
    processes=lambda orders: {processes},
    stop=lambda orders: {stop},
    example={{}},
)
"""
PROCESSES = "[DriverProcess((one.name,), '{}') for one in orders]"
GOOD = "StopDatagrams(7000, b'GO 0', b'DOWN')"


class Blimps:
    """An installed foreign kind whose answers are given as code."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __call__(self, processes: str = PROCESSES, stop: str = GOOD) -> None:
        (self._folder / "answering_kind.py").write_text(KIND.format(processes=processes, stop=stop))


@pytest.fixture
def blimps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Blimps]:
    install(tmp_path, "lab-blimp", "[skein.vehicles]\nblimp = answering_kind:KIND\n")
    monkeypatch.syspath_prepend(tmp_path)
    registry._found.cache_clear()
    yield Blimps(tmp_path)
    registry._found.cache_clear()
    sys.modules.pop("answering_kind", None)


def checked(capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    code = cli.run(["config", "check", str(LAB), *(word for option in OPTIONS for word in ("--set", option))])
    return code, capsys.readouterr().err


WRONG = [
    ("StopDatagrams(7000, 'GO 0', b'DOWN')", "hover must be bytes, and not empty (got 'GO 0')"),
    ("StopDatagrams(7000, b'GO 0', b'')", "land must be bytes, and not empty (got b'')"),
    ("StopDatagrams(70000, b'GO 0', b'DOWN')", "port must be a whole number from 1 to 65535 (got 70000)"),
    ("StopDatagrams('9700', b'GO 0', b'DOWN')", "port must be a whole number from 1 to 65535 (got '9700')"),
    ("StopDatagrams(7000, bytes(1473), b'DOWN')", "hover must have 1472 bytes at most (got 1473)"),
    ("StopDatagrams(7000, b'GO 0', b'DOWN', 'blimps')", "transport must be \"module:function\" (got 'blimps')"),
    ("StopDatagrams(7000, b'GO 0', b'DOWN', way=7)", "way must be text (got 7)"),
    ("StopDatagrams(7000, b'GO 0', b'DOWN', called=None)", "called must be True or False (got None)"),
    ("StopDatagrams(7000, b'GO 0', b'DOWN', hovers_s='3')", "hovers_s must be a number of seconds, 0 or more"),
    ("StopDatagrams(7000, b'GO 0', b'DOWN', hovers_s=float('nan'))", "hovers_s must be a number of seconds"),
    ("None", "must return StopDatagrams (got NoneType)"),
    ("1 / 0", "fails: ZeroDivisionError"),
    ("__import__('sys').exit('no display')", "fails: SystemExit: no display"),
]


@pytest.mark.parametrize(("stop", "why"), WRONG)
def test_stop_datagrams_that_could_not_be_sent_are_refused(blimps: Blimps, stop: str, why: str) -> None:
    blimps(stop=stop)
    with pytest.raises(SettingsError) as refused:
        stop_of(all_kinds()["blimp"], [])
    assert str(refused.value).startswith("kind: blimp: stop") and why in str(refused.value)


@pytest.mark.parametrize("stop", [WRONG[0][0], "None"])
def test_they_are_refused_at_their_line_and_before_a_run_begins(
    blimps: Blimps, capsys: pytest.CaptureFixture[str], tmp_path: Path, stop: str
) -> None:
    blimps(stop=stop)
    code, told = checked(capsys)
    assert code == ExitCode.SETTINGS and "good" not in told
    assert "--set drones.drone_3.kind=blimp: drones.drone_3.kind: blimp: stop: " in told
    with pytest.raises(SettingsError, match="kind: blimp: stop: "):
        process_table(load_field(LAB, options=OPTIONS), "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=False)


@pytest.mark.parametrize(
    ("processes", "why"),
    [
        ("None", "processes: must be a list of DriverProcess (got None)"),
        ("['drone_3']", "processes: must be a list of DriverProcess (got ['drone_3'])"),
        ("[]", "processes: must fly each of drone_3 once (got )"),
        ("[DriverProcess(('drone_1',), '{}')]", "processes: must fly each of drone_3 once (got drone_1)"),
    ],
)
def test_vehicles_without_a_driver_process_are_refused(blimps: Blimps, processes: str, why: str) -> None:
    blimps(processes=processes)
    with pytest.raises(SettingsError) as refused:
        processes_of(all_kinds()["blimp"], [SimpleNamespace(name="drone_3")])  # type: ignore[list-item]
    assert str(refused.value) == f"kind: blimp: {why}"


def test_good_answers_pass(blimps: Blimps, capsys: pytest.CaptureFixture[str]) -> None:
    blimps()
    assert checked(capsys)[0] == ExitCode.OK


def test_a_long_datagram_is_the_matter_of_a_transport_of_its_own(blimps: Blimps) -> None:
    blimps(stop="StopDatagrams(7000, bytes(1473), b'DOWN', 'blimp_link:open')")
    assert isinstance(stop_of(all_kinds()["blimp"], []), StopDatagrams)


@pytest.mark.parametrize(("stop", "end"), [(GOOD, "passed"), (WRONG[0][0], "failed"), (WRONG[2][0], "failed")])
def test_the_kit_refuses_them_too(blimps: Blimps, stop: str, end: str) -> None:
    blimps(stop=stop)
    verdict = Kit("blimp").judge(CHECKS["stop_datagrams_fit"])
    assert verdict.end == end, verdict.why
