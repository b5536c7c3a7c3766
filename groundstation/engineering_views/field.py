"""The resolved field that a recording carries."""

from collections.abc import Mapping
from typing import Any

import msgspec

from groundstation.recording.preamble import FIELD_NAME


def field_of(attachments: Mapping[str, bytes]) -> dict[str, Any]:
    """Return the resolved field among attachments; a bare one where there is none, so that the rest can be shown."""
    try:
        found: dict[str, Any] = msgspec.json.decode(attachments.get(FIELD_NAME, b"{}"), type=dict)
    except msgspec.DecodeError:
        return {}
    return found
