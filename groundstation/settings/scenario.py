"""Reads scenario files with their lines; the simulator, a process of its own, judges them."""

import json
import subprocess
import sys
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from groundstation.errors import GroundStationError, SettingsError
from groundstation.settings.document import KeyPath, Node, read
from groundstation.settings.levels import with_options
from groundstation.settings.schema import Field
from groundstation.settings.wording import closest, ordered, problem, text_of_error

_CHECK_LIMIT_S = 120.0  # two seconds of work, on a busy machine


@dataclass(frozen=True, slots=True)
class Room:
    """The setting of a scenario: a field, and its real bodies and cameras."""

    field: Field
    real: Collection[str] = ()
    real_cameras: Collection[str] = ()

    def asked(self) -> dict[str, Any]:
        """Return the rest of the simulator's order besides the scenario; a drone's camera has the drone's name."""
        cameras = [name for name in (*self.field.cameras, *self.field.drones) if name not in self.real_cameras]
        return {"field": self.field.model_dump(mode="json"), "cameras": cameras, "real": list(self.real)}


def load_scenario(path: Path, options: Sequence[str] = (), room: Room | None = None) -> dict[str, Any]:
    """Return a scenario as plain values with `a.b=c` options applied; raises SettingsError with all problems.

    room: entities that the scenario names must exist there.
    """
    tree = read(path)
    if not isinstance(tree.value, dict):
        raise SettingsError([f"{tree.origin}: must be a mapping with schema_version, target, drones, ..."])
    tree, problems = with_options(tree, options)
    plain: dict[str, Any] = tree.plain()
    problems += [_worded(fault, tree) for fault in _faults(plain, room)]
    if problems:
        raise SettingsError(ordered(problems))
    return plain


def _faults(plain: dict[str, Any], room: Room | None) -> list[dict[str, Any]]:
    command = [sys.executable, "-m", "sim_bridge.check"]
    given = json.dumps({"scenario": plain} | (room.asked() if room else {})).encode()
    try:
        result = subprocess.run(command, input=given, capture_output=True, timeout=_CHECK_LIMIT_S, check=False)
    except subprocess.TimeoutExpired as error:
        late = f"the simulator did not judge the scenario within {_CHECK_LIMIT_S:g} s: is this computer busy?"
        raise GroundStationError(late) from error
    if result.returncode not in (0, 2):
        raise GroundStationError(f"the simulator cannot judge the scenario: {result.stderr.decode(errors='replace')}")
    faults: list[dict[str, Any]] = json.loads(result.stdout)
    return faults


def _worded(fault: dict[str, Any], tree: Node) -> str:
    path = _without_variants(fault["loc"], tree)
    if fault["type"] == "extra_forbidden":
        return problem(tree.origin_of(path), f"unknown key{closest(str(path[-1]), fault['known'])}")
    return problem(tree.origin_of(path), fault["msg"] if fault["type"] == "misfit" else text_of_error(fault))


def _without_variants(location: Sequence[str | int], tree: Node) -> KeyPath:
    """Return a path without pydantic's names of variants, which are values in the file, not keys."""
    path: KeyPath = ()
    for key in location:
        here = tree.at(path)
        mapping = here.value if here is not None and isinstance(here.value, dict) else {}
        is_variant = key not in mapping and any(entry.value == key for entry in mapping.values())
        path = path if is_variant else (*path, key)
    return path
