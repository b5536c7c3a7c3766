"""The bill of materials (CycloneDX 1.5) of what is needed to run, as installed here: `supply_chain.py FILE`."""

import json
import re
import sys
import tomllib
import uuid
from collections.abc import Iterable
from contextlib import suppress
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
_NAME = re.compile(r"^[A-Za-z0-9._-]+")


def canonical(name: str) -> str:
    """Return a project's name as registries compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def installed(requirements: Iterable[str]) -> list[str]:
    """Return the names of installed distributions among requirements, without those of extras."""
    names = set()
    for requirement in requirements:
        match = _NAME.match(requirement)
        if match and "extra ==" not in requirement:
            with suppress(PackageNotFoundError):  # its marker does not hold here
                names.add(canonical(distribution(match.group()).metadata["Name"]))
    return sorted(names)


def needs(part: Distribution) -> list[str]:
    """Return what a distribution needs."""
    return installed(part.requires or ())


def closure(first: Iterable[str]) -> dict[str, Distribution]:
    """Return some distributions and all that they need to run, by name."""
    found: dict[str, Distribution] = {}
    waiting = list(first)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found[name] = distribution(name)
            waiting += needs(found[name])
    return dict(sorted(found.items()))


def sbom() -> dict[str, Any]:
    """Return the bill of materials; the same parts give the same document."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    direct = installed(project["dependencies"])
    parts = closure(direct)
    own = _component(project["name"], project["version"], project["license"])
    refs = {name: _component(name, part.version)["bom-ref"] for name, part in parts.items()}
    graph = [{"ref": own["bom-ref"], "dependsOn": [refs[name] for name in direct]}]
    graph += [{"ref": refs[name], "dependsOn": [refs[one] for one in needs(part)]} for name, part in parts.items()]
    identity = uuid.uuid5(uuid.NAMESPACE_URL, json.dumps(graph))
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "serialNumber": f"urn:uuid:{identity}",
        "version": 1,
        "metadata": {"component": own | {"type": "application"}},
        "components": [_component(name, part.version, _license(part)) for name, part in parts.items()],
        "dependencies": graph,
    }


def _component(name: str, version: str, license_name: str = "") -> dict[str, Any]:
    reference = f"pkg:pypi/{name}@{version}"
    component: dict[str, Any] = {"type": "library", "name": name, "version": version}
    component |= {"bom-ref": reference, "purl": reference}
    return component | ({"licenses": [{"license": {"name": license_name}}]} if license_name else {})


def _license(part: Distribution) -> str:
    stated = part.metadata.get("License-Expression") or part.metadata.get("License") or ""
    return stated.strip().split("\n")[0][:80]


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(json.dumps(sbom(), indent=1) + "\n", encoding="utf-8")
