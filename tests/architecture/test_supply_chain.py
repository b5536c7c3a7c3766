"""The bill of materials: all that the product needs to run, each part pinned and named as registries name it."""

import importlib.util
import re
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


def test_each_part_that_runs_is_pinned(tool: ModuleType) -> None:
    pins = {tool.canonical(line.split("==")[0]) for line in (ROOT / "constraints.txt").read_text().splitlines()}
    assert {part["name"] for part in tool.sbom()["components"]} <= pins


def test_pins_hold_no_address() -> None:
    assert not re.search(r"https?:|@|index", (ROOT / "constraints.txt").read_text())
