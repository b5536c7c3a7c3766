"""Emulated MAVLink vehicles and a free port for SITL tests, as in the contract tests of the links."""

import importlib.util
from pathlib import Path

_SPEC = importlib.util.spec_from_file_location(
    "mavlink_links_fixtures", Path(__file__).parents[1] / "contract" / "mavlink_links" / "conftest.py"
)
assert _SPEC is not None and _SPEC.loader is not None
_fixtures = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(_fixtures)
hangar, port = _fixtures.hangar, _fixtures.port
