"""The identity of an emulated MAVLink vehicle."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from groundstation.errors import SettingsError
from sim_bridge.site import SiteDrone


class MavlinkIdentity(BaseModel):
    """Flavour and system id of a MAVLink vehicle, and the port that it listens on or calls."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    flavour: Literal["px4", "ardupilot"]
    system_id: int
    port: int = 14550
    listen: bool = False
    local_address: str = "127.0.0.1"


def identity_of(drone: SiteDrone) -> MavlinkIdentity:
    """Return the identity of a MAVLink vehicle; raises SettingsError if its settings lack it."""
    section: dict[str, Any] = drone.section("mavlink")
    if not section:
        raise SettingsError([f"kind: {drone.kind} has no mavlink section"])
    return MavlinkIdentity.model_validate(section)
