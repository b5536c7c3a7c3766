"""Makes the section of a target's odometry driver from the field, also for an emulated router."""

from collections.abc import Mapping
from typing import TypeVar

from drivers.target_odometry.settings import OdometrySection, emulated_source
from groundstation.field.targets import odometry_name
from groundstation.settings.schema import Field
from groundstation.settings.target import TargetOdometrySettings, TrackedBody

_Body = TypeVar("_Body", bound=TrackedBody)


def odometry_section(name: str, target: TrackedBody, odometry: TargetOdometrySettings) -> OdometrySection:
    """Return the settings of the driver of a target's odometry."""
    assert target.max_speed_m_s is not None  # its base has filled it in
    return OdometrySection(
        name=odometry_name(name), target=name, max_speed_m_s=target.max_speed_m_s, **odometry.model_dump()
    )


def with_emulated_odometry(field: Field, places: Mapping[str, tuple[str, int]]) -> Field:
    """Return the field with targets' odometry at the places of emulated routers, by the odometry's name."""
    target = field.target and _emulated(field.target.name, field.target, places)
    targets = {name: _emulated(name, one, places) for name, one in field.targets.items()}
    return field.model_copy(update={"target": target, "targets": targets})


def _emulated(name: str, target: _Body, places: Mapping[str, tuple[str, int]]) -> _Body:
    place = places.get(odometry_name(name))
    if target.odometry is None or place is None:
        return target
    source = emulated_source(target.odometry.source, *place)
    return target.model_copy(update={"odometry": target.odometry.model_copy(update={"source": source})})
