"""Every vehicle kind is treated as itself: ours, a foreign package's, an unknown one, a broken one."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from installation import install
from pydantic import ValidationError

from groundstation.cli import main as cli
from groundstation.cli.exits import ExitCode
from groundstation.errors import SettingsError
from groundstation.flight.composition import process_table
from groundstation.settings.load import load_field
from groundstation.settings.new_field import NewDrone, NewRoom, NewTarget, field_text, offers
from groundstation.settings.schema import Field
from groundstation.settings.sections import driver_sections, rerouted
from groundstation.supervisor.process_spec import FailsafeDatagrams
from groundstation.vehicles import all_kinds, kind_named, refused_kinds, registry
from sim_bridge import scenario

ROOT = Path(__file__).parents[3]
CONFIG = ROOT / "config"
REFUSED = r"kind: zeppelin is not known; known: .*ardrone, mavlink"

FOREIGN = """
import click
from groundstation.vehicles import DriverProcess, ErrorHabits, KindCommands, StopDatagrams, VehicleKind
from sim_bridge.section import Section


class Figures(Section):
    '''Every emulated blimp.'''

    leak: float = 0.1


blimp = click.Group("blimp", {"inflate": click.Command("inflate", callback=lambda: print("inflated"))})
KIND = VehicleKind(
    name="blimp",
    summary="a blimp",
    driver="blimp_driver:run",
    habits=ErrorHabits(1.0, 1.0, 1.0, 0.1, 0.0, True, True),
    processes=lambda orders: [DriverProcess((one.name,), '{"name": "' + one.name + '"}') for one in orders],
    stop=lambda orders: StopDatagrams(7000, b"hover", b"land"),
    example={"blimp": {}},
    scenario={"blimps": "blimp_kind:Figures", "balloons": "no_such_module:Figures"},
    commands=KindCommands("blimp_kind:blimp", "Meet blimps.", ("inflate",)),
)
"""
ODD = """
from dataclasses import replace

from blimp_kind import KIND


def fail(*orders):
    raise ZeroDivisionError("of their own")


UNHABITUAL = replace(KIND, name="unhabitual", habits=None)
GREEDY = replace(KIND, name="greedy")
PLACELESS = replace(KIND, name="placeless", driver="nowhere")
FAILING = replace(KIND, name="failing", check=fail, processes=fail, stop=fail, commands=None, scenario={})
TWIN = replace(KIND, name="twin")
"""
ODD_ENTRIES = """[skein.vehicles]
unhabitual = odd_kinds:UNHABITUAL
greedy = odd_kinds:GREEDY
placeless = odd_kinds:PLACELESS
failing = odd_kinds:FAILING
twin = odd_kinds:TWIN
ending = ending_kind:KIND
"""
ENTRIES = "[skein.vehicles]\nblimp = blimp_kind:KIND\nbroken = no_such_module:KIND\nodd = blimp_kind:FOREIGN\n"


@pytest.fixture
def field() -> Field:
    return load_field(CONFIG / "mixed-team.yaml")


@pytest.fixture
def unknown(field: Field) -> Field:
    """The field with a drone of an unknown kind, as if its plug-in were removed after reading."""
    name, drone = next((n, d) for n, d in field.drones.items() if d.kind == "mavlink")
    return field.model_copy(update={"drones": field.drones | {name: drone.model_copy(update={"kind": "zeppelin"})}})


@pytest.fixture
def plug_ins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """An installed foreign package: a module and the entry points from its installation."""
    (tmp_path / "blimp_kind.py").write_text(FOREIGN)
    install(tmp_path, "lab-blimp", ENTRIES)
    monkeypatch.syspath_prepend(tmp_path)
    registry._found.cache_clear()
    yield
    registry._found.cache_clear()
    sys.modules.pop("blimp_kind", None)


def failsafe_datagrams(field: Field, tmp_path: Path) -> dict[str, FailsafeDatagrams | None]:
    table = process_table(field, "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=False)
    return {spec.name: spec.failsafe_datagrams for spec in table if spec.role == "driver"}


def test_each_kind_gets_last_words_of_its_own_protocol(field: Field, tmp_path: Path) -> None:
    spoken = {name: words for name, words in failsafe_datagrams(field, tmp_path).items() if words is not None}
    assert {field.drones[name].kind for name in spoken} == {"ardrone", "mavlink"}
    for name, words in spoken.items():
        begin = b"AT*" if field.drones[name].kind == "ardrone" else b"\xfd"
        assert words.hover.startswith(begin) and words.land.startswith(begin), name


def test_vehicles_on_our_estimate_are_landed_sooner_without_their_driver(tmp_path: Path) -> None:
    def land_after_s(*options: str) -> dict[str, float]:
        field = load_field(CONFIG / "mixed-team.yaml", options=options)
        words = failsafe_datagrams(field, tmp_path)
        return {field.drones[name].kind: one.land_after_s for name, one in words.items() if one is not None}

    assert land_after_s() == {"ardrone": 3.0, "mavlink": 0.5}
    assert land_after_s("safety.land_after_s=5") == {"ardrone": 5.0, "mavlink": 0.5}


def test_an_unknown_kind_gets_no_process_no_last_words_and_no_place_in_a_simulation(
    unknown: Field, tmp_path: Path
) -> None:
    with pytest.raises(SettingsError, match=REFUSED):
        failsafe_datagrams(unknown, tmp_path)
    with pytest.raises(SettingsError, match=REFUSED):
        driver_sections(unknown)
    with pytest.raises(SettingsError, match=REFUSED):
        rerouted(unknown, dict.fromkeys(unknown.drones, "127.0.0.1"), {})


def test_an_unknown_kind_is_refused_at_its_line() -> None:
    refused = r"drones.drone_1.kind: must be .*'mavlink'.* \(got \"zeppelin\"\)"
    with pytest.raises(SettingsError, match=refused):
        load_field(CONFIG / "mixed-team.yaml", options=["drones.drone_1.kind=zeppelin"])


def test_a_mavlink_vehicle_without_its_section_is_refused_too(field: Field, tmp_path: Path) -> None:
    bare = {n: d.model_copy(update={"mavlink": None}) if d.kind == "mavlink" else d for n, d in field.drones.items()}
    with pytest.raises(SettingsError, match="kind: mavlink has no mavlink section"):
        failsafe_datagrams(field.model_copy(update={"drones": bare}), tmp_path)


@pytest.mark.usefixtures("plug_ins")
def test_a_foreign_kind_flies_by_its_own_driver_and_its_own_last_words(tmp_path: Path) -> None:
    options = ["drones.drone_3.kind=blimp", "drones.drone_3.mavlink=null", "types.ardupilot.mavlink=null"]
    field = load_field(CONFIG / "mixed-team.yaml", options=options)
    table = {
        spec.name: spec for spec in process_table(field, "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=False)
    }
    blimp = table["drone_3"]
    assert blimp.entry == "blimp_driver:run" and blimp.section == '{"name": "drone_3"}'
    words = blimp.failsafe_datagrams
    assert words is not None and (words.port, words.hover, words.land) == (7000, b"hover", b"land")
    assert words.address == field.drones["drone_3"].address


@pytest.mark.usefixtures("plug_ins")
def test_a_foreign_kind_has_commands_of_its_own(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert cli.run(["blimp", "inflate"]) == 0
    assert cli.run(["help", "all"]) == 0
    told = capsys.readouterr().out
    assert "inflated" in told and "Meet blimps." in told
    assert cli.run(["inflate"]) == ExitCode.SETTINGS
    assert "Did you mean 'blimp inflate'?" in capsys.readouterr().err
    monkeypatch.setattr(sys.modules["blimp_kind"], "blimp", None)
    assert cli.run(["blimp"]) == ExitCode.FAULT
    assert "the commands of blimp cannot be used: blimp_kind:blimp: TypeError" in capsys.readouterr().err


@pytest.mark.usefixtures("plug_ins")
def test_a_foreign_kind_has_its_own_section_in_a_scenario() -> None:
    judged = scenario._with_kinds()
    assert judged.model_validate_json('{"blimps": {"leak": 2}}').blimps.leak == 2.0
    assert judged().blimps.leak == 0.1 and judged().mavlink.configured
    with pytest.raises(ValidationError, match=r"the figures of blimp cannot be used: .*no_such_module"):
        judged.model_validate_json('{"balloons": {}}')
    assert judged.model_validate_json("{}").drones.downwash


@pytest.mark.usefixtures("plug_ins")
def test_a_new_field_may_have_any_kind() -> None:
    room = NewRoom(8, 6, 4.5, "http://192.168.1.50:8080/video.mjpg")
    for type_name, (kind, _) in offers().items():
        text = field_text("lab", room, [NewDrone(type_name, "192.168.1.11", "http://a/v")], NewTarget())
        assert f"  {type_name}:\n    kind: {kind}\n" in text
    assert {"ardrone", "px4", "ardupilot", "tello", "blimp"} <= set(offers())


@pytest.mark.usefixtures("plug_ins")
def test_a_plug_in_that_cannot_be_loaded_is_named_and_the_rest_works() -> None:
    assert {"ardrone", "mavlink", "blimp"} <= set(all_kinds())
    assert "lab-blimp" in refused_kinds()["broken"] and "no_such_module" in refused_kinds()["broken"]
    assert "odd" in refused_kinds()
    with pytest.raises(SettingsError, match=r"kind: broken cannot be used: lab-blimp .*no_such_module"):
        kind_named("broken")


@pytest.mark.usefixtures("plug_ins")
def test_an_unsound_kind_is_named_and_the_rest_works(tmp_path: Path) -> None:
    (tmp_path / "odd_kinds.py").write_text(ODD)
    (tmp_path / "ending_kind.py").write_text("import sys\n\nsys.exit('no display')\n")
    install(tmp_path, "lab-odd", ODD_ENTRIES)
    install(tmp_path, "lab-twin", "[skein.vehicles]\ntwin = odd_kinds:TWIN\nardrone = odd_kinds:TWIN\n")
    refused = refused_kinds()
    assert "lab-odd" in refused["unhabitual"] and "no ErrorHabits" in refused["unhabitual"]
    assert 'driver must be "module:attribute"' in refused["placeless"]
    assert "SystemExit: no display" in refused["ending"]
    assert "its section blimps of a scenario is that of blimp" in refused["greedy"]
    assert "lab-odd" in refused["twin"] and "lab-twin" in refused["twin"] and "twin" not in all_kinds()
    assert "lab-twin" in refused["ardrone"] and all_kinds()["ardrone"].summary.startswith("Parrot")
    options = ["drones.drone_3.kind=failing", "drones.drone_3.mavlink=null", "types.ardupilot.mavlink=null"]
    with pytest.raises(SettingsError, match="kind: failing: check fails: ZeroDivisionError: of their own"):
        load_field(CONFIG / "mixed-team.yaml", options=options)
    sys.modules.pop("odd_kinds", None)


# Shared code that still names a kind, with the reason. The list may only shrink.
NAMED = {
    "groundstation/cli/bench.py",  # benches of one codec and one link, by their names
    "groundstation/cli/tlog.py",  # a log format of one protocol
    "sim_bridge/standalone.py",  # emulators for third-party programs
}
KIND_WORD = re.compile(r"ardrone|mavlink", re.IGNORECASE)


def code_of(path: Path) -> str:
    """Return a file without docstrings and comments, whose texts may use examples."""
    text = re.sub(r'""".*?"""', "", path.read_text(), flags=re.DOTALL)
    return re.sub(r"#.*", "", text)


def test_shared_code_names_no_kind() -> None:
    apart = ("groundstation/bench/", "sim_bridge/study/", "sim_bridge/devices/")
    files = [*(ROOT / "groundstation").rglob("*.py"), *(ROOT / "sim_bridge").rglob("*.py")]
    files += [*(ROOT / "drivers").glob("*.py"), *(ROOT / "drivers/plausibility").glob("*.py")]
    shared = [p for p in files if not str(p.relative_to(ROOT)).startswith(apart) and not KIND_WORD.search(p.name)]
    naming = {str(path.relative_to(ROOT)) for path in shared if KIND_WORD.search(code_of(path))}
    assert naming - NAMED == set(), "ask the kind's object instead (groundstation.vehicles)"
    assert NAMED - naming == set(), "these name no kind any more: take them off the list"
