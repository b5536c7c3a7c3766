"""Findings of the checks before a take-off."""

import msgspec

from groundstation.bus.messages.base import Message


class PreflightFinding(msgspec.Struct, frozen=True):
    """One finding of the checks."""

    level: str
    """MUST forbids a take-off, SHOULD makes flights worse, OK needs nothing."""
    subject: str
    """A drone, a camera, or what the finding is about."""
    found: str
    """What was found, in words."""
    remedy: str = ""
    """What to do about it."""


class Preflight(Message, frozen=True, kw_only=True):
    """All findings of the checks, the gravest first; sent while no drone flies."""

    findings: tuple[PreflightFinding, ...]
    """The whole list; it replaces the one before."""
