"""How the links held: per vehicle, rates of telemetry, its longest gap, link quality, battery, refused datagrams."""

from itertools import pairwise

import msgspec
import numpy as np

from groundstation.report.tracks import RunData


class VehicleLink(msgspec.Struct, frozen=True):
    """Of one vehicle over the whole run; None where it never said so. battery: first and last value, 0..1."""

    vehicle: str
    rate_hz_p50: float
    rate_hz_min: float
    longest_silence_s: float
    link_quality_min: float | None
    battery: tuple[float, float] | None
    rejected: dict[str, int]


def links(data: RunData) -> list[VehicleLink]:
    """Return the link of each vehicle that reported."""
    return [_link(data, name) for name in sorted(data.vehicles)]


def _link(data: RunData, name: str) -> VehicleLink:
    reported = sorted(data.vehicles[name], key=lambda item: item.time_s)
    statuses, times = [item.message for item in reported], [item.time_s for item in reported]
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
        rate_hz_min=min(rates),
        longest_silence_s=max((now - before for before, now in pairwise(times)), default=0.0),
        link_quality_min=min(quality, default=None),
        battery=(battery[0], battery[-1]) if battery else None,
        rejected=rejected,
    )
