"""Quality of the links: rates of telemetry, longest gap, link quality, battery, refused datagrams of each vehicle."""

from itertools import dropwhile

import msgspec
import numpy as np

from groundstation.report.tracks import RunData


class VehicleLink(msgspec.Struct, frozen=True):
    """Link of one vehicle over the whole run; None: never reported. battery: first and last value, 0..1.

    rate_hz_min: from its first telemetry on; longest_silence_s: longest time between two of its measurements (its
    driver sends status all the while).
    """

    vehicle: str
    rate_hz_p50: float
    rate_hz_min: float
    longest_silence_s: float | None
    link_quality_min: float | None
    battery: tuple[float, float] | None
    rejected: dict[str, int]


def links(data: RunData) -> list[VehicleLink]:
    """Return the link of each vehicle that reported."""
    return [_link(data, name) for name in sorted(data.vehicles)]


def _link(data: RunData, name: str) -> VehicleLink:
    reported = sorted(data.vehicles[name], key=lambda item: item.time_s)
    statuses, heard_s = [item.message for item in reported], data.heard_s.get(name, ())
    rates = [status.rate_hz for status in statuses]
    quality = [status.link_quality for status in statuses if status.link_quality is not None]
    battery = [status.battery for status in statuses if status.battery is not None]
    rejected: dict[str, int] = {}
    for status in statuses:
        for reason, count in status.rejected.items():
            rejected[reason] = max(count, rejected.get(reason, 0))
    return VehicleLink(
        vehicle=name,
        rate_hz_p50=float(np.median(rates)),
        # Before its first telemetry a vehicle that is still to be switched on reports 0.
        rate_hz_min=min(dropwhile(lambda rate: rate <= 0.0, rates), default=0.0),
        longest_silence_s=float(np.diff(heard_s).max()) if len(heard_s) > 1 else None,
        link_quality_min=min(quality, default=None),
        battery=(battery[0], battery[-1]) if battery else None,
        rejected=rejected,
    )
