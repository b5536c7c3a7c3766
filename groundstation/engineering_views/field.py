"""The resolved field in a recording's attachments."""

from collections.abc import Mapping

import msgspec

from groundstation.field.resolved import ResolvedField, field_from_json
from groundstation.recording.preamble import FIELD_NAME


def field_of(attachments: Mapping[str, bytes]) -> ResolvedField | None:
    """Return the resolved field among attachments; None if it cannot be read, so that the rest is still shown."""
    try:
        return field_from_json(attachments.get(FIELD_NAME, b"{}"))
    except msgspec.DecodeError:
        return None
