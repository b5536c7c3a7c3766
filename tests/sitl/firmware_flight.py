"""One flight of a firmware in step with the team, and its figures. As a program: `FLAVOUR SEED SECONDS [FAULT]`.

The fault ends it: `dark` takes the cameras, `kill` the driver, `guarded` the driver while the guardian speaks for it.
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

sys.path.insert(0, str(Path(__file__).parent))  # what lies here and is no test belongs to these tests
numba_cache.activate()  # before the kernels are imported: afterwards they would be compiled anew, for a minute
from firmware_room import NAME, Room  # noqa: E402

from drivers.mavlink.failsafe import HOVERS_S, hover_and_land  # noqa: E402
from groundstation.bus.messages import Verb  # noqa: E402

RISEN_M, SETTLED_S, START_S = 0.5, 3.0, 30.0  # hovering before the team tracks
GUARDIAN_SPEAKS_S = 0.3


class Flight(Room):  # type: ignore[misc]
    """Take-off, tracking, and a bad end."""

    def take_off(self) -> dict[str, float]:
        """Bring the team into the air; returns height and drift of the real one until it tracks."""
        self.study.start_ns, self.flying = self._now_ns, True
        for drone in self.study.world.of(Quadrotor).values():
            drone.autopilot.take_off()
        body, (pad_x, pad_y) = self.puppet.airframe, self.drone.pad_m
        drifts, heights = [0.0], [0.0]

        def hovers_long() -> bool:
            drifts.append(math.hypot(body.x - pad_x, body.y - pad_y))
            heights.append(body.z - self._floor_m)
            return self._hovered() > SETTLED_S

        self._floor_m, self._hover_since = body.z, 0.0
        up = self.until(hovers_long, START_S, Verb.TAKEOFF, "LANDED")
        assert up, f"{self.mode}: {self.process.texts[-6:]}"
        self.study.options = replace(self.study.options, take_off_s=self.study.world.time_s)
        assert self.until(lambda: self.mode == "TRACK", 5.0, Verb.TRACK, "HOVER"), self.process.texts[-6:]
        return {"highest_m": max(heights), "height_m": float(np.mean(heights[-100:])), "drift_m": max(drifts)}

    def _hovered(self) -> float:
        now_s = self.study.world.time_s
        if self.mode != "HOVER" or self.puppet.airframe.z - self._floor_m < RISEN_M:
            self._hover_since = now_s
        return now_s - self._hover_since

    def track(self, seconds: float) -> dict[str, Any]:
        """Track for a while, as long as the driver does."""
        errors, body = [], self.puppet.airframe

        def ends() -> bool:
            if self.study.world.ticks % 20 == 0:
                errors.append(math.dist(self.belief()[:2], (body.x, body.y)))
            return self.mode != "TRACK"

        began_s = self.study.world.time_s
        left = self.until(ends, seconds)
        report = self.study.score.report()
        return {
            "tracked_s": round(self.study.world.time_s - began_s, 1),
            "left": f"{self.mode}: {self.host.watchdog.reason}" if left else "",
            "target_rmse_m": report["target_rmse_m"], "target_max_m": report["target_max_m"],
            "belief_mean_m": float(np.mean(errors)), "belief_max_m": float(np.max(errors)),
            "separation_m": report["min_separation_m"], "anees": report["anees"].get(NAME),
        }  # fmt: skip

    def belief(self) -> tuple[float, ...]:
        """Return where the tracker has the real one."""
        return next((one.mean for one in self.study.tracker.estimates() if one.name == NAME), (math.nan,) * 4)

    def end_badly(self, fault: str, limit_s: float = 30.0) -> dict[str, Any]:
        """Take its cameras (dark), its driver (kill), or its driver while a guardian speaks (guarded).

        Returns time and distance to rest or floor.
        """
        body = self.puppet.airframe
        start, began_s = (body.x, body.y), self.study.world.time_s
        self.study.blind, self.killed = fault == "dark", fault != "dark"
        slow_since, farthest = [began_s], [0.0]

        def rests() -> bool:
            now_s = self.study.world.time_s
            if fault == "guarded":
                self._guard(now_s - began_s)
            farthest.append(math.dist(start, (body.x, body.y)))
            if math.hypot(body.vx, body.vy) > 0.1:
                slow_since[0] = now_s
            return body.z < self._floor_m + 0.05 or now_s - slow_since[0] > 3.0

        rested = self.until(rests, limit_s)
        how = "floor" if body.z < self._floor_m + 0.05 else "rest" if rested else "flies on"
        took_s = (self.study.world.time_s if how == "floor" else slow_since[0]) - began_s
        return {"ends": how, "took_s": round(took_s, 2), "farthest_m": round(max(farthest), 3)}

    def _guard(self, elapsed_s: float) -> None:
        if self.study.world.ticks % 20:
            return
        hover, land = hover_and_land([self.system])
        link: Any = self.fleet.link
        if elapsed_s > GUARDIAN_SPEAKS_S:
            link.send_raw(self.system, hover if elapsed_s < HOVERS_S else land)


def fly(flavour: str, seed: int, seconds: float, folder: Path, fault: str = "", **more: Any) -> dict[str, Any]:
    """Fly once; returns the figures."""
    room = Flight(flavour, seed, folder, **more)
    began = time.monotonic()
    try:
        with room.clocked():
            room.get_ready()
            figures: dict[str, Any] = {"flavour": flavour, "seed": seed, **room.take_off(), **room.track(seconds)}
            if fault and not figures["left"]:
                figures |= room.end_badly(fault)
            figures["speed"] = round(room.study.world.time_s / (time.monotonic() - began), 2)
            figures["alone_s"] = round(room.alone_s, 3)
            figures["texts"] = room.process.texts[-12:]
            return figures
    finally:
        room.close()
        (folder / "trace.jsonl").write_text("".join(json.dumps(row) + "\n" for row in room.trace))


if __name__ == "__main__":
    _flavour, _seed, _seconds, *_fault = sys.argv[1:]
    _folder = Path(tempfile.mkdtemp(prefix=f"room-{_flavour}-{_seed}-"))
    print(json.dumps(fly(_flavour, int(_seed), float(_seconds), _folder, *_fault) | {"trace": str(_folder)}, indent=1))
