"""One flight of firmwares in step with the team, and its figures. As a program: FLAVOURS SEED SECONDS [FAULT [HOVER]].

FLAVOURS: px4, ardupilot, or px4,ardupilot for both in one flight.

The fault ends the flight: `dark` takes the cameras, `kill` the driver, `guarded` the driver while the guardian sends
failsafe commands, `none` nothing. HOVER: duration of the hover before TRACK [s].
"""

import json
import math
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.process import numba_cache
from sim_bridge.world.ardrone import Quadrotor

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
numba_cache.activate()  # before the kernels are imported: otherwise they would be compiled again, for a minute
from firmware_room import Room  # noqa: E402
from firmware_seat import Seat  # noqa: E402

from drivers.mavlink.failsafe import HOVERS_S, heartbeat, hover_and_land  # noqa: E402
from drivers.mavlink.failsafe_transport import HEARTBEATS_S  # noqa: E402
from groundstation.bus.messages import Verb  # noqa: E402

# Drones of the mixed team; the other ones are emulated.
NAMES = ("drone_2", "drone_3")
RISEN_M, SETTLED_S, START_S = 0.5, 3.0, 30.0  # duration of the hover before tracking
GUARDIAN_SPEAKS_S = 0.3
Figures = dict[str, Any]


class Course:
    """Course of one firmware's flight, checked in each slice: it `rises`, `tracks` and `sinks` in turn."""

    def __init__(self, seat: Seat, room: Room, hover_s: float = SETTLED_S) -> None:
        self.hover_s, self._nearest_m = hover_s, math.inf
        self._seat, self._room, self._body = seat, room, seat.puppet.airframe
        self._floor_m, self._hover_since = self._body.z, 0.0
        self._drifts, self._heights, self._errors = [0.0], [0.0], [0.0]
        self._left, self._started_at = "", (0.0, 0.0)
        self._began_s = self._slow_since = 0.0
        self._farthest_m = 0.0

    @property
    def _now_s(self) -> float:
        return self._room.study.world.time_s

    def rises(self) -> bool:
        """Return whether it has not hovered long enough yet."""
        body, (pad_x, pad_y) = self._body, self._seat.drone.pad_m
        self._drifts.append(math.hypot(body.x - pad_x, body.y - pad_y))
        self._heights.append(body.z - self._floor_m)
        if self._seat.mode != "HOVER" or body.z - self._floor_m < RISEN_M:
            self._hover_since = self._now_s
        else:
            world = self._room.study.world
            rows = zip(world.bodies, world.states(), strict=True)
            others = (row[:3] for name, row in rows if name in world.drones and name != self._seat.name)
            self._nearest_m = min(self._nearest_m, *(math.dist(one, (body.x, body.y, body.z)) for one in others))
        return self._now_s - self._hover_since <= self.hover_s

    def tracks(self) -> bool:
        """Return whether its driver still tracks."""
        if self._room.study.world.ticks % 20 == 0:
            believed = (one.mean for one in self._room.study.tracker.estimates() if one.name == self._seat.name)
            place = next(believed, (math.nan, math.nan))
            self._errors.append(math.dist(place[:2], (self._body.x, self._body.y)))
        if self._seat.mode != "TRACK" and not self._left:
            self._left = f"{self._seat.mode}: {self._seat.host.watchdog.reason}"
        return not self._left

    def lose(self, fault: str) -> None:
        """Remove its cameras (dark) or its driver."""
        self._started_at = (self._body.x, self._body.y)
        self._began_s = self._slow_since = self._now_s
        if fault == "dark":
            self._room.study.blind |= {self._seat.name}
        else:
            self._seat.killed = True

    def sinks(self, fault: str) -> bool:
        """Return whether it has reached neither floor nor rest; a guardian sends meanwhile (guarded)."""
        if fault == "guarded":
            self._guard(self._now_s - self._began_s)
        body = self._body
        if math.hypot(body.vx, body.vy, body.vz) > 0.1:
            self._slow_since = self._now_s
        if self._is_down:
            return False
        self._farthest_m = max(self._farthest_m, math.dist(self._started_at, (body.x, body.y)))
        self._ended_s = self._now_s
        return self._now_s - self._slow_since <= 3.0

    @property
    def _is_down(self) -> bool:
        return bool(self._body.z < self._floor_m + 0.05)

    def _guard(self, elapsed_s: float) -> None:
        if self._room.study.world.ticks % 20:
            return
        hover, land = hover_and_land([self._seat.system])
        link: Any = self._seat.fleet.link
        if elapsed_s > GUARDIAN_SPEAKS_S:
            beat = heartbeat() if elapsed_s < GUARDIAN_SPEAKS_S + HEARTBEATS_S else b""
            link.send_raw(self._seat.system, beat + (hover if elapsed_s < HOVERS_S else land))

    def figures(self) -> Figures:
        """Return the figures of take-off and tracking."""
        return {
            "name": self._seat.name, "flavour": self._seat.flavour, "left": self._left,
            "highest_m": max(self._heights), "height_m": float(np.mean(self._heights[-100:])),
            "drift_m": max(self._drifts), "hover_nearest_m": self._nearest_m,
            "belief_mean_m": float(np.mean(self._errors)),
            "belief_max_m": float(np.max(self._errors)),
            "anees": self._room.study.score.report()["anees"].get(self._seat.name),
        }  # fmt: skip

    def end(self) -> Figures:
        """Return time and distance to rest or floor."""
        how = "floor" if self._is_down else "flies on" if self.sinks("") else "rest"
        took_s = (self._ended_s if how == "floor" else self._slow_since) - self._began_s
        return {"ends": how, "took_s": round(took_s, 2), "farthest_m": round(self._farthest_m, 3)}


def take_off(room: Room, courses: list[Course]) -> None:
    """Bring the team into the air, and start tracking."""
    room.study.start_ns, room.flying = room.now_ns(), True
    for seat in room.seats:
        seat.flying = True
    for drone in room.study.world.of(Quadrotor).values():
        drone.autopilot.take_off()
    limit_s = START_S + max(one.hover_s for one in courses)
    up = room.until(lambda: sum(one.rises() for one in courses) == 0, limit_s, Verb.TAKEOFF, "LANDED")
    assert up, room.said()
    room.study.mode = "TRACK"
    room.study.options = replace(room.study.options, take_off_s=room.study.world.time_s)
    assert room.until(lambda: all(seat.mode == "TRACK" for seat in room.seats), 5.0, Verb.TRACK, "HOVER"), room.said()


def track(room: Room, courses: list[Course], seconds: float) -> Figures:
    """Track for a while, as long as all drivers do; returns the figures of the team."""
    began_s = room.study.world.time_s
    room.until(lambda: sum(one.tracks() for one in courses) < len(courses), seconds)
    report, kept = room.study.score.report(), ("target_rmse_m", "target_max_m", "min_separation_m")
    tracked_s = round(room.study.world.time_s - began_s, 1)
    return {"tracked_s": tracked_s, **{key: report[key] for key in kept}}


def fly(
    flavours: list[str], seed: int, seconds: float, folder: Path, fault: str = "", hover_s: float = SETTLED_S,
    **more: Any,
) -> Figures:  # fmt: skip
    """Fly once; returns the figures of the team, those of each firmware under `firmwares`."""
    room = Room(dict(zip(NAMES, flavours, strict=False)), seed, folder, **more)
    began = time.monotonic()
    try:
        with room.clocked():
            room.get_ready()
            courses = [Course(seat, room, hover_s) for seat in room.seats]
            take_off(room, courses)
            figures = {"seed": seed, **track(room, courses, seconds)}
            firmwares = [one.figures() for one in courses]
            if fault and not any(one["left"] for one in firmwares):
                for one in courses:
                    one.lose(fault)
                room.until(lambda: sum(one.sinks(fault) for one in courses) == 0, 30.0)
                firmwares = [known | one.end() for known, one in zip(firmwares, courses, strict=True)]
            for known, seat in zip(firmwares, room.seats, strict=True):
                known["texts"] = seat.process.texts[-12:]
            speed = round(room.study.world.time_s / (time.monotonic() - began), 2)
            return figures | {"speed": speed, "alone_s": round(room.alone_s, 3), "firmwares": firmwares}
    finally:
        room.close()
        (folder / "trace.jsonl").write_text("".join(json.dumps(row) + "\n" for row in room.trace))


if __name__ == "__main__":
    _flavours, _seed, _seconds, *_more = sys.argv[1:]
    _fault = _more[0] if _more and _more[0] != "none" else ""
    _hover_s = float(_more[1]) if len(_more) > 1 else SETTLED_S
    _folder = Path(tempfile.mkdtemp(prefix=f"room-{_seed}-"))
    _figures = fly(_flavours.split(","), int(_seed), float(_seconds), _folder, _fault, _hover_s)
    print(json.dumps(_figures | {"trace": str(_folder)}, indent=1))
