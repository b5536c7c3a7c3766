"""The bridge's start order: `python -m sim_bridge --spec FILE`."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from groundstation.errors import SettingsError
from groundstation.field.targets import odometry_name
from groundstation.process.child import ChildSpec
from sim_bridge.scenario import Scenario, describe_problems, parse_scenario
from sim_bridge.scenario_fit import misfits
from sim_bridge.site import Site, parse_site


class PoseSource(StrEnum):
    """Source of a real body's pose: its firmware's simulator, motion capture, the tracker, or none."""

    AUTOPILOT = "autopilot"
    CAPTURE = "capture"
    ESTIMATE = "estimate"
    NONE = "none"


_UNSEEN = frozenset({PoseSource.ESTIMATE, PoseSource.NONE})


class RealBody(BaseModel):
    """A real body; address: receives its firmware's simulated true state; system: motion capture that follows it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    source: PoseSource
    address: tuple[str, int] | None = None
    system: str = ""


class _Envelope(BaseModel):
    """The parts of an order; field and scenario are validated by their own models."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    child: ChildSpec
    field: dict[str, Any]
    scenario: dict[str, Any] = {}
    addresses: dict[str, str]
    streams: dict[str, tuple[str, int]] = {}
    captures: dict[str, tuple[str, int]] = {}
    real: dict[str, RealBody] = {}
    seed: int | None = Field(default=None, ge=0)


@dataclass(frozen=True, slots=True)
class LaunchSpec:
    """A checked start order.

    addresses: loopback address of each emulated drone; streams: address and port of each emulated
    camera, by the name of the world-fixed camera or of the drone that carries it; real: drones and targets that exist;
    captures: address and port of each emulated motion capture or ranging system, and router of a target's odometry.
    """

    child: ChildSpec
    site: Site
    scenario: Scenario
    addresses: dict[str, str]
    streams: dict[str, tuple[str, int]]
    seed: int
    real: Mapping[str, RealBody] = field(default_factory=dict)
    captures: Mapping[str, tuple[str, int]] = field(default_factory=dict)

    @property
    def unseen(self) -> frozenset[str]:
        """Return the bodies that emulated cameras must not show: their places are estimates, or unknown."""
        return frozenset(name for name, body in self.real.items() if body.source in _UNSEEN)


def read_order(path: Path) -> LaunchSpec:
    """Return the order in a file; raises SettingsError with all problems of the first part that is wrong."""
    try:
        envelope = _Envelope.model_validate_json(path.read_bytes())
    except OSError as error:
        raise SettingsError([f"{path}: {error.strerror}"]) from error
    except ValidationError as error:
        raise SettingsError(describe_problems(str(path), error)) from None
    site = parse_site(envelope.field)
    scenario = parse_scenario(json.dumps(envelope.scenario))
    if strangers := sorted(set(envelope.real) - set(site.bodies)):
        raise SettingsError([f"{path}: real: {name!r} is no body of the field" for name in strangers])
    heard = map(odometry_name, site.tracked)
    if strangers := sorted(set(envelope.captures) - {*site.motion_capture, *site.ranging, *heard}):
        raise SettingsError([f"{path}: captures: {name!r} is no system or odometry of the field" for name in strangers])
    if unfit := misfits(scenario, site, envelope.streams, envelope.real):
        raise SettingsError([str(one) for one in unfit])
    missing = sorted(set(site.drones) - set(envelope.addresses) - set(envelope.real))
    if missing:
        raise SettingsError([f"{path}: addresses: none for {', '.join(missing)}"])
    seed = scenario.seed if envelope.seed is None else envelope.seed
    addresses, streams, real, captures = envelope.addresses, envelope.streams, envelope.real, envelope.captures
    return LaunchSpec(envelope.child, site, scenario, addresses, streams, seed, real, captures)
