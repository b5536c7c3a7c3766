"""Fake camera source and process, for tests of the camera driver."""

import json
from collections import Counter, deque
from typing import Any

from drivers.camera.settings import CameraDriverSettings
from drivers.camera.sources.frames import Matrix, Packet, Unit
from groundstation.bus import clock

LENS: dict[str, Any] = {"width_px": 640, "height_px": 360, "fx_px": 460, "fy_px": 460, "cx_px": 319.5, "cy_px": 179.5}
LENS |= {"distortion": [-0.30, 0.08, 0, 0, 0]}
SECTION: dict[str, Any] = {
    "name": "drone_1_camera",
    "source": "http://127.0.0.1:9/video.mjpg",
    "calibration": LENS,
    "mount": {"parent": "drone_1", "position_m": [0.09, 0, 0], "tilt_down_deg": 45},
    "video_delay_ms": 120,
    "markers": [
        {"entity": "drone_1", "code": 1, "square_mm": 44, "position_m": [0, 0, 0.08]},
        {"entity": "bot", "code": 5, "square_mm": 44, "position_m": [0, 0, 0.4], "kind": "target"},
    ],
    "start_within_s": 0.05,
    "stall_after_s": 0.05,
}


def settings(**changes: Any) -> CameraDriverSettings:
    return CameraDriverSettings.model_validate_json(json.dumps({**SECTION, **changes}))


class FakeSource:
    def __init__(self) -> None:
        self.packets, self.received, self.connected, self.detail = deque[Packet](), 0, True, ""
        self.units, self.rejected = list[Unit](), Counter[str]()

    def push(self, data: bytes, arrival_ns: int | None = None) -> None:
        self.received += 1
        arrival_ns = arrival_ns or clock.now_ns()
        self.packets.append(Packet(data, arrival_ns, arrival_ns, self.received))

    def take_newest(self, timeout_s: float) -> Packet | None:
        return self.packets.popleft() if self.packets else None

    def push_decoded(self, pixels: Any, unit: Unit) -> None:
        self.received += 1
        self.packets.append(Packet(b"", unit.arrival_ns, unit.settled_ns, self.received, Matrix(pixels)))
        self.units.append(unit)

    def take_video(self) -> list[Unit]:
        units, self.units = self.units, []
        return units

    def close(self) -> None:
        pass


class FakeChild:
    stop_requested, supervisor_alive, supervisor_fresh, spoken_for_ns = False, True, True, 0

    def __init__(self, bus: Any, section: str = "{}") -> None:
        self.bus, self.name, self.section = bus, "drone_1_camera", section
        self.states, self.events, self.beats = list[Any](), list[Any](), 0

    def ready(self, detail: str = "") -> None:
        self.states.append(("READY", detail))

    def degrade(self, detail: str, works: bool = True) -> None:
        self.states.append(("DEGRADED", detail))

    def event(self, severity: Any, text: str, remedy: str = "", entity: str | None = None) -> None:
        self.events.append((str(severity), text, remedy))

    def beat(self) -> None:
        self.beats += 1

    def note_addresses(self, addresses: Any) -> None: ...
    def finish(self) -> None: ...
    def leave(self, number: int) -> None: ...
    def tick_status(self, ticks: int = 0, overruns: int = 0, overflowed: int = 0) -> None: ...

    def sleep_until(self, deadline_ns: int) -> bool:
        return True

    def wake(self) -> None:
        pass
