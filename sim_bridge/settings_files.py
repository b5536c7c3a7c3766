"""Fields and scenarios as the ground station's command line reads them: nothing in the simulator reads YAML."""

import subprocess
import sys
from collections.abc import Iterable

from groundstation.errors import SettingsError
from groundstation.field.resolved import ResolvedField, field_from_json
from sim_bridge.scenario import Scenario, parse_scenario


def resolved_field(name: str, overrides: Iterable[str]) -> ResolvedField:
    """Return a field (a path, or a shipped one's name) with `a.b=c` overrides; raises SettingsError."""
    options = [word for override in overrides for word in ("--set", override)]
    return field_from_json(_printed("show", name, "--resolved", "--json", *options))


def named_scenario(name: str) -> Scenario:
    """Return a scenario (a path, or a shipped one's name); raises SettingsError."""
    return parse_scenario(_printed("scenario", name))


def _printed(*arguments: str) -> bytes:
    command = [sys.executable, "-m", "groundstation", "config", *arguments]
    result = subprocess.run(command, capture_output=True, check=False)
    if result.returncode != 0:
        raise SettingsError([(result.stderr or result.stdout).decode(errors="replace").strip()])
    return result.stdout
