"""What the bridge is started with: `python -m sim_bridge --spec FILE`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from groundstation.errors import SettingsError
from sim_bridge.faults import check_faults
from sim_bridge.scenario import Scenario, describe_problems, parse_scenario
from sim_bridge.site import Site, parse_site


class _Envelope(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")

    child: dict[str, Any]
    field: dict[str, Any]
    scenario: dict[str, Any] = {}
    addresses: dict[str, str]
    streams: dict[str, tuple[str, int]] = {}
    seed: int | None = Field(default=None, ge=0)


@dataclass(frozen=True, slots=True)
class Order:
    """A checked start order.

    child: fields of the ChildSpec; addresses: loopback address of each drone; streams: address and port of each
    camera, by the name of the world-fixed camera or of the drone that carries it.
    """

    child: dict[str, Any]
    site: Site
    scenario: Scenario
    addresses: dict[str, str]
    streams: dict[str, tuple[str, int]]
    seed: int


def read_order(path: Path) -> Order:
    """Return the order in a file; raises SettingsError with every problem of the part that is wrong."""
    try:
        envelope = _Envelope.model_validate_json(path.read_bytes())
    except OSError as error:
        raise SettingsError([f"{path}: {error.strerror}"]) from error
    except ValidationError as error:
        raise SettingsError(describe_problems(str(path), error)) from None
    site = parse_site(envelope.field)
    scenario = parse_scenario(json.dumps(envelope.scenario))
    check_faults(scenario.faults, site.drones, envelope.streams)
    strangers = sorted(set(scenario.drones.firmware_by_drone) - set(site.drones))
    if strangers:
        names = ", ".join(site.drones)
        raise SettingsError([f"scenario: drones.firmware_by_drone: {name!r} is none of {names}" for name in strangers])
    if strangers := sorted(set(scenario.targets) - set(site.tracked)):
        names = ", ".join(site.tracked)
        raise SettingsError([f"scenario: targets.{name}: there is no such target, only {names}" for name in strangers])
    missing = sorted(set(site.drones) - set(envelope.addresses))
    if missing:
        raise SettingsError([f"{path}: addresses: none for {', '.join(missing)}"])
    seed = scenario.seed if envelope.seed is None else envelope.seed
    return Order(envelope.child, site, scenario, envelope.addresses, envelope.streams, seed)
