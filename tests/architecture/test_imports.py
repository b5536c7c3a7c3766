"""Who may import whom: the table of the architecture, held for every import statement, lazy ones included."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("groundstation", "drivers", "sim_bridge")

CORE_MODULES = ("geometry", "estimation", "sensing", "planning", "control", "tracker")
CORE = tuple(f"groundstation.{name}" for name in CORE_MODULES)
CORE_NEVER = {"socket", "asyncio", "threading", "time", "logging", "multiprocessing", "subprocess", "select", "random"}
CORE_LIBRARIES = {"numpy", "numba", "scipy", "llvmlite"}
WIRE_NEVER = {"socket", "time", "asyncio", "threading", "logging", "select", "multiprocessing", "subprocess"}
LOW = ("groundstation.errors", "groundstation.geometry", "groundstation.bus", "groundstation.process")
SHARED_DRIVER = "drivers.<shared>"


@dataclass(frozen=True)
class Import:
    """One import statement of a module: what it names, and where it stands."""

    module: str
    target: str
    place: str

    def __str__(self) -> str:
        return f"{self.place}: {self.module} imports {self.target}"


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def sources() -> tuple[Path, ...]:
    return tuple(sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py")))


@cache
def modules() -> frozenset[str]:
    return frozenset(module_name(path) for path in sources())


def imports_of(path: Path) -> Iterator[Import]:
    name, place = module_name(path), path.relative_to(ROOT)
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(name, alias.name, f"{place}:{node.lineno}")
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, base] if base else above)
            for alias in node.names:
                inner = f"{base}.{alias.name}"
                yield Import(name, inner if inner in modules() else base, f"{place}:{node.lineno}")


@cache
def all_imports() -> tuple[Import, ...]:
    return tuple(one for path in sources() for one in imports_of(path))


def within(module: str, *packages: str) -> bool:
    return any(module == package or module.startswith(f"{package}.") for package in packages)


def internal(target: str) -> bool:
    return target.split(".")[0] in PACKAGES


def kind_of_driver(module: str) -> str:
    parts = module.split(".")
    is_family = len(parts) > 2 or (len(parts) == 2 and (ROOT / "drivers" / parts[1]).is_dir())
    return parts[1] if is_family else SHARED_DRIVER


def is_wire(module: str) -> bool:
    parts = module.split(".")
    return parts[0] == "drivers" and len(parts) > 2 and parts[2] == "wire"


def is_driver_settings(module: str) -> bool:
    parts = module.split(".")
    return parts[0] == "drivers" and len(parts) > 2 and parts[2] == "settings"


def core_may(one: Import) -> bool:
    layer = CORE_MODULES.index(one.module.split(".")[1])
    below = CORE[: layer + 1]
    return within(one.target, *below, "groundstation.bus.messages", "groundstation.errors")


def driver_may(one: Import) -> bool:
    if is_wire(one.module):
        return is_wire(one.target) and kind_of_driver(one.target) == kind_of_driver(one.module)
    if within(one.target, *LOW):
        return True
    if one.target == "drivers":
        return True
    if not within(one.target, "drivers"):
        return False
    kind = kind_of_driver(one.target)
    return kind in (SHARED_DRIVER, kind_of_driver(one.module)) or is_wire(one.target)


def simulator_may(one: Import) -> bool:
    if within(one.module, "sim_bridge.study.vision") and within(one.target, "drivers.camera"):
        return True
    if within(one.module, "sim_bridge.study"):
        return within(one.target, *LOW, *CORE, "sim_bridge")
    if within(one.target, "sim_bridge.study"):
        return False
    return within(one.target, *LOW, "sim_bridge") or is_wire(one.target)


def upper_may(one: Import) -> bool:
    """The rest of groundstation: never the simulator; drivers by settings only, the command line excepted."""
    own = one.module.split(".")[1] if "." in one.module else ""
    if within(one.target, "groundstation.cli"):
        return own == "cli"
    if within(one.target, "drivers"):
        return own == "cli" or (own == "settings" and is_driver_settings(one.target))
    if own == "settings":
        return within(one.target, *LOW[:2], "groundstation.settings")
    return within(one.target, "groundstation")


def low_may(one: Import) -> bool:
    package = ".".join(one.module.split(".")[:2])
    allowed = {"groundstation.bus": LOW[:3], "groundstation.process": LOW, "groundstation.errors": ()}[package]
    return within(one.target, *allowed)


def may(one: Import) -> bool:
    if within(one.module, *CORE):
        return core_may(one)
    if within(one.module, "groundstation.bus", "groundstation.process", "groundstation.errors"):
        return low_may(one)
    if within(one.module, "drivers"):
        return driver_may(one)
    if within(one.module, "sim_bridge"):
        return simulator_may(one)
    return upper_may(one)


def report(violations: list[Import]) -> str:
    return "\n".join(map(str, violations))


@pytest.mark.parametrize("package", PACKAGES)
def test_internal_imports_follow_the_table(package: str) -> None:
    broken = [one for one in all_imports() if within(one.module, package) and internal(one.target) and not may(one)]
    assert not broken, report(broken)


def test_the_core_is_pure() -> None:
    def impure(one: Import) -> bool:
        top = one.target.split(".")[0]
        return top in CORE_NEVER or (top not in sys.stdlib_module_names and top not in CORE_LIBRARIES)

    broken = [one for one in all_imports() if within(one.module, *CORE) and not internal(one.target) and impure(one)]
    assert not broken, report(broken)


def test_wire_packages_need_the_standard_library_alone() -> None:
    def foreign(one: Import) -> bool:
        top = one.target.split(".")[0]
        allowed = {"pymavlink"} if kind_of_driver(one.module) == "mavlink" else set()
        return top in WIRE_NEVER or (top not in sys.stdlib_module_names and top not in allowed)

    broken = [one for one in all_imports() if is_wire(one.module) and not internal(one.target) and foreign(one)]
    assert not broken, report(broken)


@pytest.mark.parametrize(
    ("library", "owners"),
    [
        ("zenoh", ("groundstation.bus.zenoh_bus",)),
        ("ruamel", ("groundstation.settings", "groundstation.cli")),
        ("yaml", ()),
        ("cv2", ("drivers.camera", "sim_bridge.render", "sim_bridge.study.vision")),
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
    broken = [one for one in all_imports() if one.target.split(".")[0] == library and not within(one.module, *owners)]
    assert not broken, report(broken)


def test_nothing_is_forked() -> None:
    """A fork with threads and sockets is undefined; everything is spawned."""
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in sources()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if (isinstance(node, ast.Attribute) and node.attr in ("fork", "forkpty"))
        or (isinstance(node, ast.Constant) and node.value in ("fork", "forkserver"))
    ]
    assert not found, found


def test_import_contracts_hold() -> None:
    """`.importlinter` holds the table for indirect imports as well."""
    linter = Path(sys.executable).with_name("lint-imports")
    if not linter.exists():
        pytest.skip("import-linter is not installed")
    result = subprocess.run(
        [str(linter), "--no-cache", "--no-logo"], cwd=ROOT, capture_output=True, text=True, timeout=100, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr


def test_contracts_name_every_package_of_the_ground_station() -> None:
    """A new package must be put on one side of the fence that drivers and simulator stand behind."""
    text = (ROOT / ".importlinter").read_text(encoding="utf-8")
    packages = {path.parent.name for path in (ROOT / "groundstation").glob("*/__init__.py")}
    unnamed = [name for name in sorted(packages - {"experiments"}) if f"groundstation.{name}" not in text]
    assert not unnamed, f"add to .importlinter: {unnamed}"
