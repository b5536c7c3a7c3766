"""Settings of ranging systems: radios (UWB and others) that measure a robot's distances to anchors."""

from typing import Annotated

from pydantic import Field

from drivers.ranging.settings import parse_source
from groundstation.settings.motion_capture import VolumeSettings
from groundstation.settings.values import HostName, Name, OnVehicle, SettingsSection, Vector3, read_by


class TransponderSettings(SettingsSection):
    """The transponder of a ranging system on a drone: its name there, and its place on the drone."""

    name: Annotated[str, Field(max_length=100)] = ""
    """The transponder's name in the system; empty: that of the drone."""
    position_m: OnVehicle = (0.0, 0.0, 0.0)
    """Its antenna [m; base]."""


class RangingSettings(SettingsSection):
    """A ranging system: a sensor that is fixed in the world, as cameras are, and observes drones only."""

    source: Annotated[str, read_by(parse_source)]
    """The gateway that is asked for ranges: ranges://192.168.1.6:7417, a program that speaks the datagrams of
    docs/reference/ranges.md 2 for the radios at hand."""
    host: HostName = ""
    """Name of the host that listens to it, as the site admitted it. Empty: the host of the run."""
    anchors: Annotated[dict[Name, Vector3], Field(min_length=4, max_length=32)]
    """Where each anchor's antenna is [m; world], by its name in the system."""
    volume_m: VolumeSettings
    """The box in which drones have enough anchors in view [m; world]. The planner counts on it."""
    transponders: dict[Name, TransponderSettings] = Field(default_factory=dict)
    """The transponders by drone, where their names or places are not those of the drone itself."""
    rate_hz: Annotated[float, Field(ge=1, le=100)] = 10.0
    """How often a drone is measured against all anchors per second."""
    delay_ms: Annotated[float, Field(ge=0, le=500)] = 20.0
    """Time [ms] from a measurement to the arrival of its datagram; an age in the datagram comes on top."""
    range_std_m: Annotated[float, Field(gt=0, le=2)] = 0.08
    """Standard deviation [m] of one range, without errors that last for seconds."""
    bias_std_m: Annotated[float, Field(gt=0, le=2)] = 0.05
    """Standard deviation [m] of errors of an anchor's ranges that last for seconds: survey, antenna, reflections."""
    outlier_share: Annotated[float, Field(ge=0, le=0.5)] = 0.02
    """Share of ranges that are too long because of reflections; simulations have them, plans count on fewer ranges."""
    reach_m: Annotated[float, Field(gt=0, le=500)] = 30.0
    """Longest range [m]; a longer one is not used."""
    pad_heading_std_deg: Annotated[float, Field(gt=0, le=30)] = 10.0
    """Standard deviation [deg] of the heading of a drone that was put on its pad. Ranges show no heading of a standing
    drone: it is that of the pad until the drone moves, or something else sees it."""
