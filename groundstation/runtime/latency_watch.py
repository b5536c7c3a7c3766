"""Warns the operator when a camera's pictures are older or newer than its configured delay; no action follows."""

import math

from groundstation.bus.messages import Message, Odometry, RelativeObservation, SensorLateness, Severity
from groundstation.bus.notice import Notice
from groundstation.estimation.camera_latency import Lateness, LatenessWatch
from groundstation.field.resolved import ResolvedField

# A warning begins when a delay this wrong explains the turns 100 times better than a right one, as in the diagnosis,
# and the error exceeds this; it ends below the second figures.
_WRONG_S, _SURE, _TOLERATED_S = 0.08, math.log(100.0), 0.015
_SIGMAS_AGAIN, _TOLERATED_AGAIN_S = 2.0, 0.010


class PictureAge:
    """Feeds a LatenessWatch with accepted sightings, and turns its findings into notices.

    clock: the clock whose stamps count; stamps of another host would need its offset.
    """

    def __init__(self, field: ResolvedField, clock: str) -> None:
        self._watch, self._clock = LatenessWatch(), clock
        self._settings = {
            name: (f"cameras.{name}.video_delay_ms", camera.video_delay_ms) for name, camera in field.cameras.items()
        }
        self._settings |= {
            name: (f"drones.{name}.camera.video_delay_ms", drone.camera.video_delay_ms)
            for name, drone in field.drones.items()
        }
        self._told: dict[str, bool] = {}

    def take(self, message: Message) -> None:
        """Take a message that the tracker accepted."""
        header = message.header
        if header.clock != self._clock:
            return
        if isinstance(message, Odometry):
            self._watch.turned(header.entity, header.stamp_ns, message.yaw_rad, message.reset)
        elif isinstance(message, RelativeObservation) and message.observer in self._settings:
            name = message.observer
            self._watch.saw(name, name, message.subject, header.stamp_ns, message.yaw_rad)

    def lateness(self) -> tuple[SensorLateness, ...]:
        """Return the measured lateness of each camera against its setting."""
        return tuple(SensorLateness(one.sensor, 1e3 * one.offset_s, 1e3 * one.std_s) for one in self._watch.told())

    def notices(self) -> list[Notice]:
        """Return new warnings about cameras, and withdrawals; call it about once a second."""
        found = []
        for one in self._watch.told():
            told, off_s = self._told.get(one.sensor, False), abs(one.offset_s)
            if not told and off_s > _TOLERATED_S and _lead(one) > _SURE:
                self._told[one.sensor] = True
                found.append(self._warning(one))
            elif told and off_s < max(_TOLERATED_AGAIN_S, _SIGMAS_AGAIN * one.std_s):
                self._told[one.sensor] = False
                found.append(
                    Notice(Severity.INFO, "its pictures are as old as configured after all", entity=one.sensor)
                )
        return found

    def _warning(self, one: Lateness) -> Notice:
        key, now_ms = self._settings[one.sensor]
        than, other = ("older", "newer") if one.offset_s > 0.0 else ("newer", "older")
        # Turns in pictures are compared with turns in telemetry: which of the two is late is not observable.
        text = (
            f"its pictures seem {1e3 * abs(one.offset_s):.0f} +- {1e3 * one.std_s:.0f} ms {than} than configured, "
            f"or the telemetry that they are compared with is as much {other}"
        )
        better = max(0.0, now_ms + 1e3 * one.offset_s)
        setting = f"{key}: {better:.0f} (now {now_ms:.0f})"
        return Notice(
            Severity.WARNING,
            text,
            f"groundstation calibrate team tells which; of the pictures, set {setting}",
            one.sensor,
        )


def _lead(one: Lateness) -> float:
    """Return the log likelihood ratio of a wrong delay against a right one."""
    wide, narrow = _WRONG_S**2 + one.std_s**2, one.std_s**2
    return 0.5 * (one.offset_s**2 * (1.0 / narrow - 1.0 / wide) - math.log(wide / narrow))
