"""An emulated motion capture system: a NatNet server that streams the true poses of all bodies, with its noise.

WIRE (docs/reference/natnet.md 2): who asked to connect is sent frames for as long as it is heard.
"""

import math
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from drivers.motion_capture.wire import natnet
from groundstation.arrays import Array
from groundstation.geometry.rotations import rotation_from_euler, rotation_x, rotation_z
from sim_bridge.fault_kinds import Fault, FaultKind, standing
from sim_bridge.listening import open_udp
from sim_bridge.mounting import surveyed
from sim_bridge.site import SiteBody, SiteCapture

Address = tuple[str, int]
VERSION = (4, 1)
_TICKS_PER_S = 10_000_000
_FRAME_TICKS = 2  # 100 frames a second
_TICK_S = 0.005
_DATAGRAMS_PER_TICK = 64
_FORGOTTEN_TICKS = 2000  # a client that is silent for 10 s is gone
# What the system itself needs before it sends a frame, and says of it [s].
_PROCESSING_S = 0.005


class NatnetEmulator:
    """Sockets and noise around the states of all bodies; `sim_bridge.world.emulation.Emulator`.

    states: returns a row for each body, as `World.states` has them; errors: whether its axes are a little off.
    """

    def __init__(
        self, name: str, place: Address, system: SiteCapture, bodies: Iterable[str], states: Callable[[], Array],
        rng: np.random.Generator, faults: Iterable[Fault] = (), errors: bool = True,
    ) -> None:  # fmt: skip
        self.silent = self.deaf = False
        self._name, self._system, self._states, self._rng = name, system, states, rng
        self._bodies = tuple(bodies)
        self._ids = {entity: number for number, entity in enumerate(self._bodies, start=1)}
        self._faults = tuple(faults)
        self._socket = open_udp(f"emulated {name}", *place)
        self._server = natnet.Server("Skein", VERSION, _TICKS_PER_S, place[1], "")
        self._heard: dict[Address, int] = {}
        self._ticks = self._frames = 0
        upright = rotation_x(math.pi / 2) if system.up == "y" else np.eye(3)
        self._world_from_system = rotation_z(math.radians(system.yaw_deg)) @ upright
        self._upright = upright
        self._rotation, self._origin = surveyed(system, errors, rng)
        self._waiting: list[tuple[int, bytes]] = []
        self._frozen: natnet.Frame | None = None

    def fileno(self) -> int:
        """Return the descriptor of its port."""
        return self._socket.fileno()

    def receive(self) -> None:
        """Answer all waiting requests."""
        for _ in range(_DATAGRAMS_PER_TICK):
            try:
                datagram, sender = self._socket.recvfrom(2048)
                kind, _ = natnet.message_of(datagram)
            except OSError:
                return
            except natnet.WireError:
                continue
            if self.deaf:
                continue
            if kind == natnet.CONNECT:
                self._heard[sender] = self._ticks
                self._answer(natnet.encode_server(self._server), sender)
            elif kind == natnet.REQUEST_DESCRIPTIONS:
                names = {number: self._body(entity).name or entity for entity, number in self._ids.items()}
                self._answer(natnet.encode_descriptions(names, VERSION), sender)
            elif sender in self._heard:
                self._heard[sender] = self._ticks

    def send(self) -> None:
        """End a tick: take a frame when one is due, and send those whose time on the way is over."""
        self._ticks += 1
        now_s = self._ticks * _TICK_S
        if self._ticks % _FRAME_TICKS == 0:
            self._frames += 1
            late = round((_PROCESSING_S + self._system.delay_ms / 1000) / _TICK_S)
            self._waiting.append((self._ticks + late, natnet.encode_frame(self._frame(now_s), VERSION)))
        self._heard = {one: heard for one, heard in self._heard.items() if self._ticks - heard < _FORGOTTEN_TICKS}
        while self._waiting and self._waiting[0][0] <= self._ticks:
            _, datagram = self._waiting.pop(0)
            if not self.silent and standing(self._faults, FaultKind.CAPTURE_SILENT, now_s, self._name) is None:
                for client in self._heard:
                    self._answer(datagram, client)

    def close(self) -> None:
        """Close the port."""
        self._socket.close()

    def _answer(self, datagram: bytes, client: Address) -> None:
        with suppress(OSError):
            self._socket.sendto(datagram, client)

    def _frame(self, now_s: float) -> natnet.Frame:
        exposed = self._ticks * round(_TICK_S * _TICKS_PER_S)
        sent = exposed + round(_PROCESSING_S * _TICKS_PER_S)
        if self._frozen is not None and standing(self._faults, FaultKind.CAPTURE_FROZEN, now_s, self._name) is not None:
            return replace(self._frozen, number=self._frames, exposed=exposed, sent=sent)
        at = dict(zip(self._bodies, self._states(), strict=True))
        swapped = standing(self._faults, FaultKind.BODIES_SWAPPED, now_s)
        if swapped is not None and swapped.other is not None:
            at[swapped.entity], at[swapped.other] = at[swapped.other], at[swapped.entity]
        seen = [self._seen(entity, row, now_s) for entity, row in at.items() if not math.isnan(row[0])]
        self._frozen = natnet.Frame(self._frames, tuple(seen), exposed, sent)
        return self._frozen

    def _seen(self, entity: str, row: Array, now_s: float) -> natnet.Body:
        """Return the body on an entity, given the entity's true state."""
        body, noise = self._body(entity), self._rng.standard_normal(6)
        place_std, turn_std = self._system.pose_std_m, math.radians(self._system.heading_std_deg)
        base = rotation_from_euler(*(row[6:9] + turn_std * noise[3:]).tolist())
        origin = row[:3] + base @ np.array(body.position_m) + place_std * noise[:3]
        jumped = standing(self._faults, FaultKind.BODY_JUMPED, now_s, entity)
        if jumped is not None:
            origin = origin + np.array([jumped.amount, 0.0, 0.0])
        origin = self._rotation.T @ (origin - self._origin)
        world_from_body = self._rotation.T @ base @ rotation_z(math.radians(body.yaw_deg))
        system_from_world = self._world_from_system.T
        place = system_from_world @ (origin - np.array(self._system.position_m))
        turned = system_from_world @ world_from_body @ self._upright
        box = self._system.volume_m
        spans = zip(row[:3], (box.x_m, box.y_m, box.z_m), strict=True)
        inside = all(low <= value <= high for value, (low, high) in spans)
        x, y, z = place.tolist()
        return natnet.Body(self._ids[entity], (x, y, z), quaternion_of(turned), inside)

    def _body(self, entity: str) -> SiteBody:
        return self._system.bodies.get(entity, SiteBody())


def quaternion_of(rotation: Array) -> tuple[float, float, float, float]:
    """Return (x, y, z, w) of a rotation (3, 3), by the eigenvector of its largest eigenvalue (Bar-Itzhack 2000)."""
    r = rotation
    K = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    x, y, z, w = np.linalg.eigh(K)[1][:, -1].tolist()
    return (x, y, z, w) if w >= 0 else (-x, -y, -z, -w)
