"""Third-party libraries are imported only in their own packages; `.importlinter` has the rules for our packages."""

import ast
import configparser
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("groundstation", "drivers", "sim_bridge")

CORE = tuple(
    f"groundstation.{n}"
    for n in ("geometry", "estimation", "sensing", "planning", "control", "tracker", "tracker_parameters", "forecast")
)
NO_EFFECTS = {"socket", "asyncio", "threading", "time", "logging", "multiprocessing", "subprocess", "select"}
NUMERICS = {"numpy", "numba", "scipy", "llvmlite"}
VALUES = {"msgspec"}  # structs, as messages are: so are the values made from each message


@dataclass(frozen=True)
class Import:
    """One import of a library by a module, at its head or in a function."""

    module: str
    library: str
    place: str

    def __str__(self) -> str:
        return f"{self.place}: {self.module} imports {self.library}"


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def sources() -> tuple[Path, ...]:
    return tuple(sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py")))


def imports_of(path: Path) -> Iterator[Import]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
        if isinstance(node, ast.Import):
            targets = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            targets = [node.module or ""]
        else:
            continue
        for target in targets:
            library, place = target.split(".")[0], f"{path.relative_to(ROOT)}:{node.lineno}"
            if library not in PACKAGES:
                yield Import(module_name(path), library, place)


@cache
def all_imports() -> tuple[Import, ...]:
    return tuple(one for path in sources() for one in imports_of(path))


def within(module: str, *packages: str) -> bool:
    return any(module == package or module.startswith(f"{package}.") for package in packages)


def of(*packages: str) -> list[Import]:
    return [one for one in all_imports() if within(one.module, *packages)]


def report(violations: list[Import]) -> str:
    return "\n".join(map(str, violations))


@pytest.mark.parametrize(
    ("packages", "libraries", "never"),
    [
        pytest.param(CORE, NUMERICS | VALUES, NO_EFFECTS | {"random"}, id="the core"),
        pytest.param(("drivers.ardrone.wire",), set(), NO_EFFECTS, id="wire of AR.Drone"),
        pytest.param(("drivers.mavlink.wire",), {"pymavlink"}, NO_EFFECTS, id="wire of MAVLink"),
    ],
)
def test_computing_packages_import_only_libraries_without_side_effects(
    packages: tuple[str, ...], libraries: set[str], never: set[str]
) -> None:
    imports = of(*packages)
    assert imports, "there is no such package"
    allowed = (sys.stdlib_module_names - never) | libraries
    broken = [one for one in imports if one.library not in allowed]
    assert not broken, report(broken)


def test_settings_open_no_socket() -> None:
    places = ("groundstation.settings", *(f"drivers.{kind}.settings" for kind in ("ardrone", "camera", "mavlink")))
    broken = [one for one in of(*places) if one.library == "socket"]
    assert not broken, report(broken)


@pytest.mark.parametrize(
    ("library", "owners"),
    [
        (
            "zenoh",
            (
                "groundstation.bus.zenoh_bus",
                "groundstation.engineering_views.ros2.live",
                "drivers.rmw_zenoh.session",
                "sim_bridge.devices.ros2_router",
            ),
        ),
        ("ruamel", ("groundstation.settings", "groundstation.cli")),
        ("yaml", ()),
        (
            "cv2",
            (
                "drivers.camera",
                "sim_bridge.render",
                "sim_bridge.study.vision",
                "groundstation.recording.blurring",
                "groundstation.console.qr",
            ),
        ),
        ("av", ("drivers.camera", "drivers.ardrone", "sim_bridge.devices", "sim_bridge.study.vision")),
        ("click", ("groundstation.cli",)),
        (
            "matplotlib",
            ("groundstation.settings.drawing", "groundstation.report", "groundstation.experiments", "sim_bridge.study"),
        ),
        ("rich", ("groundstation.cli", "groundstation.monitor", "groundstation.runtime", "groundstation.report")),
    ],
)
def test_a_library_has_its_place(library: str, owners: tuple[str, ...]) -> None:
    broken = [one for one in all_imports() if one.library == library and not within(one.module, *owners)]
    assert not broken, report(broken)


def test_nothing_is_forked() -> None:
    """A fork with threads and sockets is undefined; every process is spawned."""
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in sources()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if (isinstance(node, ast.Attribute) and node.attr in ("fork", "forkpty"))
        or (isinstance(node, ast.Constant) and node.value in ("fork", "forkserver"))
    ]
    assert not found, found


def test_kernels_have_one_kind() -> None:
    """Only groundstation.kernel compiles, so that all kernels have annotations and the same arithmetic and cache."""
    compiling = {"njit", "jit", "vectorize", "guvectorize", "cfunc"}
    found = []
    for path in sources():
        if path == ROOT / "groundstation/kernel.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
            match node:
                case ast.ImportFrom(module="numba", names=imported):
                    names = {alias.name for alias in imported}
                case ast.Attribute(value=ast.Name(id="numba"), attr=name):
                    names = {name}
                case _:
                    names = set()
            found += [f"{path.relative_to(ROOT)}: {name}" for name in sorted(names & compiling)]
    assert not found, "\n".join(found)


def test_import_contracts_hold() -> None:
    linter = Path(sys.executable).with_name("lint-imports")
    result = subprocess.run(
        [str(linter), "--no-cache", "--no-logo"], cwd=ROOT, capture_output=True, text=True, timeout=100, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr


def test_each_package_of_the_ground_station_has_a_layer() -> None:
    """The simulator may import it only where the simulator's contract says so."""
    contracts = configparser.ConfigParser()
    contracts.read(ROOT / ".importlinter")
    layers = contracts["importlinter:contract:layers"]["layers"]
    folder = ROOT / "groundstation"
    modules = {p.parent.name for p in folder.glob("*/__init__.py")} | {p.stem for p in folder.glob("[!_]*.py")}
    ours = {f"groundstation.{name}" for name in modules}
    assert set(layers.replace("|", " ").split()) == ours | {"drivers"}
    above_drivers = set(layers.partition("\ndrivers")[0].replace("|", " ").split())
    assert set(contracts["importlinter:contract:simulator-is-blind"]["forbidden_modules"].split()) == above_drivers
