"""Starts, watches and ends the emulated cameras: one render process each."""

import multiprocessing
import os
import socket
import time
from collections.abc import Callable, Collection, Iterable, MutableSequence
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from groundstation.errors import GroundStationError
from groundstation.geometry.board import Checkerboard
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.tag import SquareTag
from groundstation.process.priority import take_share
from groundstation.vehicles import kind_named
from sim_bridge.fault_kinds import Fault, FaultKind, exchanged
from sim_bridge.mounting import generator_of_eye, mounted, on_drone, true_lens
from sim_bridge.own_video import OwnVideo
from sim_bridge.render.spec import (
    BoardSpec,
    BodyShape,
    BoxSpec,
    FloorKind,
    Mount,
    Outage,
    OutageKind,
    PictureQuality,
    RenderSpec,
)
from sim_bridge.scenario import Scenario
from sim_bridge.site import Site
from sim_bridge.world.emulation import video_of
from sim_bridge.world.obstacles import all_obstacles, box_names

Stream = tuple[str, int]
_START_LIMIT_S = 45.0
_STOP_LIMIT_S = 1.5
# The readers' patience.
_HUNG_UP_AFTER_S = 2.0


def render_specs(
    site: Site,
    scenario: Scenario,
    streams: dict[str, Stream],
    truth_name: str,
    seed: int,
    unseen: Collection[str] = (),
) -> list[RenderSpec]:
    """Return the orders of all render processes; raises GroundStationError for a stream of no known camera.

    unseen: bodies that no camera shows.
    """
    about = all_obstacles(scenario.obstacles, site.room.obstacles.values())
    boxes = tuple(BoxSpec(name, one.size_m) for name, one in zip(box_names(len(about)), about, strict=True))
    body_at, errors = exchanged(scenario.faults), scenario.cameras.mounting_errors
    optics = {name: _optics(site, body_at.get(name, name), errors, seed) for name in streams}
    return [
        RenderSpec(
            camera=name,
            mount=optics[name][0],
            intrinsics=optics[name][1],
            boards=tuple(board for board in _boards(site) if board.body not in unseen),
            truth_name=truth_name,
            bodies=(*site.bodies, *(box.body for box in boxes)),
            address=address,
            port=port,
            own=_own_video(site, name, scenario),
            scenario=_camera_scenario(scenario, name),
            seed=seed,
            room_size_m=site.room.size_m,
            parent_pid=os.getpid(),
            boxes=boxes,
        )
        for name, (address, port) in streams.items()
    ]


def _own_video(site: Site, name: str, scenario: Scenario) -> OwnVideo | None:
    drone = site.drones.get(name)
    if drone is None or drone.camera is None:
        return None
    scheme = kind_named(drone.kind).camera
    own = bool(scheme) and drone.camera.source.startswith(f"{scheme}://")
    return video_of(drone.kind, name, scenario) if own else None


def _optics(site: Site, name: str, errors: bool, seed: int) -> tuple[Mount, CameraIntrinsics]:
    """Return a camera's mounting and lens as they really are."""
    rng = generator_of_eye(seed, name)
    drone, camera = site.drones.get(name), site.cameras.get(name)
    if camera is not None:
        return Mount(Pose(*mounted(camera, errors, rng))), true_lens(camera.calibration, errors, rng)
    if drone is None or drone.camera is None:
        raise GroundStationError(f"stream {name!r} belongs to no camera of the field")
    return Mount(Pose(*on_drone(drone.camera, errors, rng)), name), true_lens(drone.camera.calibration, errors, rng)


def _boards(site: Site) -> tuple[BoardSpec, ...]:
    drones = tuple(
        _board(name, drone.marker.printed, drone.marker.position_m, BodyShape.DRONE)
        for name, drone in site.drones.items()
    )
    targets = tuple(
        _board(name, target.marker.printed, (0.0, 0.0, target.marker.height_m), BodyShape.TURTLEBOT)
        for name, target in site.tracked.items()
    )
    return drones + targets


def _board(
    body: str, printed: Checkerboard | SquareTag, place: tuple[float, float, float], shape: BodyShape
) -> BoardSpec:
    if isinstance(printed, SquareTag):
        return BoardSpec(body, 0, 0.0, place, shape, printed)
    return BoardSpec(body, printed.code, printed.square_mm, place, shape)


def _camera_scenario(scenario: Scenario, name: str) -> PictureQuality:
    outages = tuple(
        Outage(kind, fault.start_s, fault.end_s)
        for fault in scenario.faults
        if fault.entity == name and (kind := _outage_kind(fault)) is not None
    )
    own = (FaultKind.CAMERA_BUMPED, FaultKind.PICTURE_FROZEN, FaultKind.PICTURE_BLACK)
    faults = tuple(
        fault
        for fault in scenario.faults
        if fault.kind is FaultKind.WRONG_BOARD or (fault.kind in own and fault.entity == name)
    )
    figures = scenario.cameras.model_dump(exclude={"floor", "mounting_errors"})
    return PictureQuality(**figures, floor=FloorKind(scenario.cameras.floor), outages=outages, faults=faults)


def _outage_kind(fault: Fault) -> OutageKind | None:
    """Return how a fault breaks a stream, if it does."""
    match fault.kind:
        case FaultKind.CAMERA_CUT:
            return OutageKind.CUT
        case FaultKind.CAMERA_HELD_BACK if fault.end_s is not None and fault.end_s - fault.start_s < _HUNG_UP_AFTER_S:
            return OutageKind.HELD_BACK
        case FaultKind.CAMERA_STALL | FaultKind.CAMERA_HELD_BACK:
            return OutageKind.STALL
    return None


def _render(spec: RenderSpec, modes: Connection | None, tally: MutableSequence[int]) -> None:
    # Linux shares the processor out by session first (autogroup): drawing must not use up what the bridge's loop gets.
    os.setsid()
    take_share(-10)  # a real camera waits for nothing on this machine
    from sim_bridge.render.process import run

    raise SystemExit(run(spec, modes, tally))


class Cameras:
    """The render processes, from start to end."""

    def __init__(self, specs: Iterable[RenderSpec]) -> None:
        # spawn: a fork would copy the threads of Zenoh in an undefined state
        context = multiprocessing.get_context("spawn")
        self._specs = tuple(specs)
        self._processes: dict[str, SpawnProcess] = {}
        self._modes: dict[str, tuple[Connection, object]] = {}
        self._tallies: list[MutableSequence[int]] = []
        for spec in self._specs:
            told: Connection | None = None
            tally = context.RawArray("q", 2)
            self._tallies.append(tally)
            if spec.own is not None:
                told, teller = context.Pipe(duplex=False)
                self._modes[spec.camera] = teller, None
            process = context.Process(
                target=_render, args=(spec, told, tally), name=f"render-{spec.camera}", daemon=True
            )
            process.start()
            self._processes[spec.camera] = process
            if told is not None:
                told.close()  # the process has its own end: ours, kept open, would hide that it is gone

    def wait_until_serving(self, should_stop: Callable[[], bool]) -> None:
        """Return when every stream accepts connections; raises GroundStationError naming the one that does not."""
        deadline = time.monotonic() + _START_LIMIT_S
        for spec in (one for one in self._specs if one.own is None or one.own.listens):
            while not should_stop() and not _accepts(spec.address, spec.port):
                if spec.camera in self.ended() or time.monotonic() > deadline:
                    raise GroundStationError(
                        f"camera {spec.camera} does not serve {spec.address}:{spec.port}: is the port in use?"
                    )
                time.sleep(0.05)

    @property
    def configurable(self) -> tuple[str, ...]:
        """Return the drones that serve their own video."""
        return tuple(self._modes)

    def set_mode(self, drone: str, mode: tuple[object, ...]) -> None:
        """Send a drone's video configuration to its camera, if it has changed."""
        teller, known = self._modes[drone]
        if mode != known:
            self._modes[drone] = teller, mode
            with suppress(OSError):  # a process that has ended is reported by `ended`
                teller.send(tuple(mode))

    @property
    def pictures(self) -> tuple[int, int]:
        """Return the number of pictures drawn, and of those that were not ready when they should have arrived."""
        return sum(tally[0] for tally in self._tallies), sum(tally[1] for tally in self._tallies)

    def ended(self) -> list[str]:
        """Return the cameras whose process is gone."""
        return [name for name, process in self._processes.items() if not process.is_alive()]

    def stop(self) -> None:
        """End all render processes, at the latest after 1.5 s by force."""
        for process in self._processes.values():
            process.terminate()
        deadline = time.monotonic() + _STOP_LIMIT_S
        for process in self._processes.values():
            process.join(max(0.0, deadline - time.monotonic()))
            if process.is_alive():
                process.kill()
                process.join()


def _accepts(address: str, port: int) -> bool:
    with suppress(OSError), socket.create_connection((address, port), timeout=0.5):
        return True
    return False
