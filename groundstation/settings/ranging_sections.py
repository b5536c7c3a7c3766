"""Makes each ranging driver's section from the field."""

from drivers.ranging.settings import RangingSection, TransponderSection
from groundstation.settings.ranging import TransponderSettings
from groundstation.settings.schema import Field


def ranging_section(field: Field, name: str) -> RangingSection:
    """Return the settings of the driver of a ranging system."""
    system = field.ranging[name]
    volume, own = system.volume_m, system.transponders
    return RangingSection(
        name=name,
        source=system.source,
        anchors=dict(system.anchors),
        transponders=tuple(
            TransponderSection(entity=drone, name=own.get(drone, TransponderSettings()).name or drone)
            for drone in field.drones
        ),
        volume_m=(volume.x_m, volume.y_m, volume.z_m),
        delay_ms=system.delay_ms,
        range_std_m=system.range_std_m,
        bias_std_m=system.bias_std_m,
        reach_m=system.reach_m,
    )
