"""Sections of a scenario: obstacles, zones of the floor, radio bursts, and expected results."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from sim_bridge.section import Section
from sim_bridge.target_paths import Path, Side, Standstill, rising

Length = Annotated[float, Field(gt=0, le=20)]
Flow = Annotated[float, Field(ge=-2, le=2)]
Seconds = Annotated[float, Field(ge=0.02, le=60)]


class Obstacle(Section):
    """An upright box along the room's axes that hides markers behind it: furniture, a person. Nothing collides."""

    size_m: tuple[Length, Length, Length] = (0.5, 0.5, 1.75)
    """Its size along world x, y and z [m]; it stands on the floor."""
    path: Annotated[Path, Field(discriminator="shape")] = Standstill()
    """Place of its middle, or the path along which that moves."""
    base: Literal["turtlebot_2", "person", "rc_car"] = "person"
    """Limits of its motion, as of targets."""


class FloorZone(Section):
    """A part of the floor over which an AR.Drone's optical flow is off, as over a moving or repetitive pattern."""

    x_m: Side
    """Its extent along world x [m]."""
    y_m: Side
    """Its extent along world y [m]."""
    flow_bias_m_s: tuple[Flow, Flow]
    """Error added to the reported velocity [x, y in m/s; world]."""


class LinkBursts(Section):
    """Random bursts in which a vehicle's radio carries nothing: navdata, commands, its pictures."""

    per_minute: Annotated[float, Field(ge=0, le=600)] = 0.0
    """How many bursts each vehicle has in a minute, on average."""
    length_s: Annotated[tuple[Seconds, Seconds], AfterValidator(rising)] = (0.2, 1.5)
    """How long one lasts [s]."""
    from_s: Annotated[float, Field(ge=0, le=86_400)] = 15.0
    """None before this time [s after the simulator is ready]."""


class ScenarioExpectation(Section):
    """How a scenario is flown by `groundstation experiment scenarios`, and the results that each flight must have."""

    field: str = "lab"
    """The field that it is made for."""
    set: tuple[str, ...] = ()
    """Settings of that field that it changes, as --set has them."""
    seconds: Annotated[float, Field(ge=5, le=3600)] = 45.0
    """How long the team tracks [s]."""
    rmse_m: Annotated[float, Field(gt=0, le=100)] | None = None
    """Greatest rms error of the target [m] from when it was found; none: any."""
    lost_s: Annotated[float, Field(ge=0, le=3600)] | None = None
    """Longest time with an error above 0.5 m [s] after it was found; none: any."""
    found_s: Annotated[float, Field(ge=0, le=3600)] | None = None
    """Latest time at which the target is found [s after the team tracks]; none: any."""
    landings: Annotated[int, Field(ge=0, le=99)] = 0
    """How many drones may land, or have their motors stopped."""
