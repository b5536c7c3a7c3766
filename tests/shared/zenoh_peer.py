"""A foreign session on a Zenoh network of this host."""

import json
from typing import Any

import zenoh


def opened(**settings: Any) -> Any:
    """Return a session with some settings, without multicast scouting."""
    silent = {"scouting": {"multicast": {"enabled": False}}}
    return zenoh.open(zenoh.Config.from_json5(json.dumps(silent | settings)))
