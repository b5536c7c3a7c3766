"""Who is tracked, as a resolved field says it: one `target`, or several `targets` by name."""

from collections.abc import Mapping
from typing import Any


def targets_of(resolved: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Return the settings of each target by name, in the field's order (decoded JSON of the settings' Field)."""
    single = resolved.get("target")
    return dict(resolved.get("targets") or {}) if single is None else {str(single["name"]): single}
