"""A lab whose field file is wrong: the world is built with other figures than the ground station gets."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import msgspec

from groundstation.bus.messages import RelativeObservation
from groundstation.field.resolved import ResolvedField

_FIXED = {"x": ("position_m", 0), "y": ("position_m", 1), "z": ("position_m", 2)}
_FIXED |= {"roll": ("rotation_deg", 0), "pitch": ("rotation_deg", 1), "yaw": ("rotation_deg", 2)}
_ONBOARD = {"pan": "pan_left_deg", "tilt": "tilt_down_deg"}
_PLACES = ("ahead", "left", "up")
_PAD = ("pad_x", "pad_y", "pad_yaw")


@dataclass(frozen=True, slots=True)
class WrongFigures:
    """True figures minus those of the field file, by (entity, part): m, deg, ms, shares.

    Parts: x, y, z, roll, pitch, yaw of a fixed camera; pan, tilt, ahead, left, up of a drone's; focal and delay of any;
    print of a drone or target; pad_x, pad_y, pad_yaw of a drone's true place. exchanged: carrier and owner of a marker;
    covariance_share: stated share of the sightings' covariance.
    """

    errors: Mapping[tuple[str, str], float]
    exchanged: Mapping[str, str] = field(default_factory=dict)
    covariance_share: float = 1.0

    def world(self, told: ResolvedField) -> ResolvedField:
        """Return the field with the true figures; lenses, prints and delays are in the sightings instead."""
        cameras, drones = dict(told.cameras), dict(told.drones)
        for (who, part), error in self.errors.items():
            if who in cameras and part in _FIXED:
                name, axis = _FIXED[part]
                moved = list(getattr(cameras[who], name))
                moved[axis] += error
                cameras[who] = _with(cameras[who], name, tuple(moved))
            elif who in drones and (part in _ONBOARD or part in _PLACES):
                drones[who] = _with(drones[who], "camera", _mounted(drones[who].camera, part, error))
            elif who in drones and part in _PAD:
                drones[who] = _placed(drones[who], part, error)
        return msgspec.structs.replace(told, cameras=cameras, drones=drones)

    def reported(self, o: RelativeObservation) -> RelativeObservation:
        """Return a sighting as a detector with the field's figures reports it."""
        printed, focal, late_ms = (
            self._of(o.subject, "print"),
            self._of(o.observer, "focal"),
            self._of(o.observer, "delay"),
        )
        turned = math.radians(self._of(o.observer, "pan") + self._of(o.observer, "yaw"))
        x, y, z = (value / (1.0 + printed) for value in o.position_m)
        yaw = None if o.yaw_rad is None else math.remainder(o.yaw_rad - turned, math.tau)
        header = msgspec.structs.replace(o.header, stamp_ns=o.header.stamp_ns + round(late_ms * 1e6))
        place = (x, y, z / (1.0 + focal))
        return msgspec.structs.replace(
            o,
            header=header,
            subject=self.exchanged.get(o.subject, o.subject),
            position_m=place,
            yaw_rad=yaw,
            covariance=tuple(self.covariance_share * value for value in o.covariance),
        )

    def _of(self, who: str, part: str) -> float:
        return self.errors.get((who, part), 0.0)


def misdated(told: ResolvedField, video_delay_ms: float) -> WrongFigures:
    """Return the wrong figures of a field whose video delays differ from the true ones, as at the wire."""
    delays = {name: camera.video_delay_ms for name, camera in told.cameras.items()}
    delays |= {name: drone.camera.video_delay_ms for name, drone in told.drones.items()}
    return WrongFigures({(n, "delay"): video_delay_ms - ms for n, ms in delays.items() if ms != video_delay_ms})


def _with(struct: Any, name: str, value: Any) -> Any:
    return msgspec.structs.replace(struct, **{name: value})


def _mounted(camera: Any, part: str, error: float) -> Any:
    if part in _ONBOARD:
        return _with(camera, _ONBOARD[part], getattr(camera, _ONBOARD[part]) + error)
    place = list(camera.position_m)
    place[_PLACES.index(part)] += error
    return _with(camera, "position_m", tuple(place))


def _placed(drone: Any, part: str, error: float) -> Any:
    if part == "pad_yaw":
        return _with(drone, "pad_yaw_deg", drone.pad_yaw_deg + error)
    x, y = drone.pad_m
    return _with(drone, "pad_m", (x + error, y) if part == "pad_x" else (x, y + error))
