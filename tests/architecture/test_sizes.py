"""Limits on the length of files and functions, no packages for leftovers, and other rules of style."""

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("groundstation", "drivers", "sim_bridge")
MODULE_LINES = 320
FUNCTION_LINES = 60
PARAMETERS = 8
DRAWERS = {"utils", "util", "helpers", "helper", "common", "misc"}


def sources(*folders: str) -> Iterator[Path]:
    for folder in folders:
        yield from sorted((ROOT / folder).rglob("*.py"))


def test_no_module_is_too_long() -> None:
    counts = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in sources(*PACKAGES, "tests", "docs")}
    long = [f"{path.relative_to(ROOT)}: {count} lines" for path, count in counts.items() if count > MODULE_LINES]
    assert not long, "\n".join(long)


def test_no_function_is_too_long() -> None:
    long = []
    for path in sources(*PACKAGES, "tests", "docs"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                length = (node.end_lineno or node.lineno) - node.lineno + 1
                if length > FUNCTION_LINES:
                    long.append(f"{path.relative_to(ROOT)}:{node.lineno} {node.name}: {length} lines")
    assert not long, "\n".join(long)


def test_no_function_has_too_many_parameters() -> None:
    """Values that belong together are passed together; `self` and `cls` do not count."""
    many = []
    for path in sources(*PACKAGES):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                given = node.args
                names = [one.arg for one in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
                count = len([name for name in names if name not in ("self", "cls")])
                if count > PARAMETERS:
                    many.append(f"{path.relative_to(ROOT)}:{node.lineno} {node.name}: {count} parameters")
    assert not many, "\n".join(many)


def test_no_module_is_a_drawer() -> None:
    drawers = [str(path.relative_to(ROOT)) for path in sources(*PACKAGES) if DRAWERS & {path.stem, path.parent.name}]
    assert not drawers, drawers


def test_modules_say_what_they_are() -> None:
    silent = []
    for path in sources(*PACKAGES):
        text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        if len(text) < 10 or "TODO" in text:
            silent.append(str(path.relative_to(ROOT)))
    assert not silent, silent


def test_packages_have_a_readme() -> None:
    """The packages one level down; deeper ones are described by the README above them."""
    folders = [ROOT / "config", *(ROOT / name for name in PACKAGES[1:])]
    for package in PACKAGES:
        folders += [path.parent for path in sorted((ROOT / package).glob("*/__init__.py"))]
    bare = [str(path.relative_to(ROOT)) for path in folders if not (path / "README.md").is_file()]
    assert not bare, bare


def test_nothing_flies_differently_in_simulation() -> None:
    """Simulation and field differ in addresses, not in code paths."""
    words = ("SIM=", "is_sim", "simulated=", "SIMULATION", "if sim")
    found = []
    for path in sources("drivers", *(f"groundstation/{name}" for name in ("control", "planning", "estimation"))):
        text = path.read_text(encoding="utf-8")
        found += [f"{path.relative_to(ROOT)}: {word}" for word in words if word in text]
    assert not found, found
