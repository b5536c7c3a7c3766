"""Installed packages: each is pinned and in the bill of materials, and no file without a known hash is installed."""

import ast
import hashlib
import importlib.metadata
import importlib.util
import re
import shlex
import subprocess
import sys
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("supply_chain", ROOT / ".ci" / "supply_chain.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_each_part_that_runs_is_listed_with_its_version(tool: ModuleType) -> None:
    document = tool.sbom()
    parts = {part["name"]: part for part in document["components"]}
    assert {"eclipse-zenoh", "cryptography", "cffi", "numba", "llvmlite", "pydantic-core"} <= set(parts)
    assert not {"pytest", "ruff", "skein-groundstation"} & set(parts)
    for name, part in parts.items():
        assert part["bom-ref"] == part["purl"] == f"pkg:pypi/{name}@{part['version']}"
    references = {row["ref"] for row in document["dependencies"]}
    assert references == {document["metadata"]["component"]["bom-ref"], *(part["bom-ref"] for part in parts.values())}
    assert all(set(row["dependsOn"]) <= references for row in document["dependencies"])
    assert tool.sbom() == document, "the same parts give the same document"


LISTS = sorted((ROOT / "requirements").glob("*.txt"))
LISTS_OF_OTHERS = sorted((ROOT / "tests" / "interop").glob("*.txt"))


def hashes_of(path: Path) -> dict[str, list[str]]:
    """Return the pins of a list with the hashes of each; fails on anything else in it."""
    found: dict[str, list[str]] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        pin = re.fullmatch(r"([a-z0-9._-]+==[a-z0-9.+!]+)( ; [a-z_]+ [!<>=]+ '[\w.]+'( and .*)?)? \\", line, re.I)
        digest = re.fullmatch(r"    --hash=(sha256:[0-9a-f]{64})( \\)?", line)
        assert pin or digest or line.startswith("#"), f"{path.name}: {line}"
        if pin:
            found[pin[1].lower()] = []
        elif digest:
            found[list(found)[-1]].append(digest[1])
    return found


def pins() -> set[str]:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    return {
        "==".join((re.sub(r"[-_.]+", "-", name).lower(), version)) for name, version in (x.split("==") for x in lines)
    }


@pytest.mark.parametrize("path", LISTS + LISTS_OF_OTHERS, ids=lambda path: path.stem)
def test_each_pin_has_the_hashes_of_its_files(path: Path) -> None:
    found = hashes_of(path)
    assert found
    assert [pin for pin, digests in found.items() if not digests] == [], "make hashes"


def test_the_lists_are_the_pins() -> None:
    assert {path.stem for path in LISTS} == {"run", "test", "test-slow", "check", "docs"}
    assert set().union(*map(hashes_of, LISTS)) == pins(), "make hashes"


def test_imports_of_tests_are_installed_by_make_test() -> None:
    """Modules that tests import at collection are installed; one missing import would stop the whole run."""
    local = {path.stem for folder in ("tests", "docs", ".ci") for path in (ROOT / folder).rglob("*")}
    own = {path.name for path in ROOT.iterdir()} | local | sys.stdlib_module_names
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py")]
    bodies = [ast.parse(text).body for text in texts if "importorskip" not in text]
    imports = {name.split(".")[0] for body in bodies for node in body for name in imported(node)}
    distributions = importlib.metadata.packages_distributions()
    needed = {re.sub(r"[-_.]+", "-", distributions[name][0]).lower() for name in imports - own}
    lists = [ROOT / "requirements" / f"{name}.txt" for name in ("run", "test")]
    assert needed - {pin.split("==")[0] for path in lists for pin in hashes_of(path)} == set()


def imported(node: ast.stmt) -> list[str]:
    if isinstance(node, ast.ImportFrom):
        return [node.module or ""]
    return [alias.name for alias in node.names] if isinstance(node, ast.Import) else []


def test_each_part_that_runs_is_installed_by_its_hash(tool: ModuleType) -> None:
    listed = {pin.split("==")[0] for pin in hashes_of(ROOT / "requirements" / "run.txt")}
    assert {part["name"] for part in tool.sbom()["components"]} | {"hatchling", "editables"} <= listed


def test_make_refuses_a_file_that_was_tampered_with(tmp_path: Path) -> None:
    """With the Makefile's options and a registry of one wheel."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    (options,) = re.findall(r"^\t\$\(INSTALL\) (.*\$\(HASHED\)) requirements/run\.txt$", makefile, re.M)
    for name in ("HASHED", "INSTALL"):
        (value,) = re.findall(rf"^{name} := (.*)$", makefile, re.M)
        options = options.replace(f"$({name})", value) if name in options else f"{value} {options}"
    wheel = tmp_path / "part-1.0-py3-none-any.whl"
    write_wheel(wheel)
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    listed = tmp_path / "run.txt"
    listed.write_text(f"part==1.0 \\\n    --hash=sha256:{digest}\n", encoding="utf-8")
    with zipfile.ZipFile(wheel, "a") as archive:
        archive.writestr("more.py", "")
    pip = [sys.executable, "-m", *shlex.split(options.replace("$(BIN)/", ""))]
    registry = ["--no-index", "--find-links", str(tmp_path), "--target", str(tmp_path / "installed")]
    done = subprocess.run([*pip, str(listed), *registry], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode != 0 and "DO NOT MATCH THE HASHES" in done.stderr, done.stderr
    assert not (tmp_path / "installed").exists()


def write_wheel(path: Path) -> None:
    info = "part-1.0.dist-info"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("part.py", "")
        archive.writestr(f"{info}/METADATA", "Metadata-Version: 2.1\nName: part\nVersion: 1.0\n")
        archive.writestr(
            f"{info}/WHEEL", "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        archive.writestr(f"{info}/RECORD", f"part.py,,\n{info}/METADATA,,\n{info}/WHEEL,,\n{info}/RECORD,,\n")


def test_pins_hold_no_address() -> None:
    for path in (ROOT / "constraints.txt", *LISTS, *LISTS_OF_OTHERS):
        assert not re.search(r"https?:|@|index-url|find-links", path.read_text(encoding="utf-8")), path
