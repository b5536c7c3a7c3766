"""Kinds of vehicles: their description (`kind`) and their registry (`registry`)."""

from groundstation.vehicles.kind import (
    DriverProcess,
    ErrorHabits,
    Finding,
    KindCommands,
    KindSection,
    Offer,
    StopDatagrams,
    VehicleKind,
    VehicleOrder,
)
from groundstation.vehicles.registry import all_kinds, kind_named, refused_kinds

__all__ = [
    "DriverProcess",
    "ErrorHabits",
    "Finding",
    "KindCommands",
    "KindSection",
    "Offer",
    "StopDatagrams",
    "VehicleKind",
    "VehicleOrder",
    "all_kinds",
    "kind_named",
    "refused_kinds",
]
