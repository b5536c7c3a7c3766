"""The bridge's loop: sockets, a step of the world, telemetry, truth; 200 times a second in real time."""

import gc
import math
import os
import time
from dataclasses import replace

from groundstation.bus.messages import Severity, SimCommand, SimStatus, TruthState
from groundstation.bus.topics import SIM_COMMAND, SIM_STATUS, TRUTH
from groundstation.field.targets import odometry_name
from groundstation.process.child import Child
from groundstation.process.priority import go_first
from sim_bridge.cameras import render_specs
from sim_bridge.devices.captured_bodies import CapturedBodies
from sim_bridge.devices.natnet import MULTICAST_GROUP, NatnetEmulator
from sim_bridge.devices.odometry_router import OdometryRouter
from sim_bridge.devices.pose_router import PoseRouter
from sim_bridge.devices.range_gateway import RangeGateway
from sim_bridge.fault_kinds import Part, exchanged, of_part
from sim_bridge.faults import FaultSchedule
from sim_bridge.launch_spec import LaunchSpec
from sim_bridge.link_bursts import with_bursts
from sim_bridge.mounting import generator_of_eye
from sim_bridge.ranges import Radios
from sim_bridge.real.followers import GOOD_NEWS, Followers
from sim_bridge.stage import Stage
from sim_bridge.tick_schedule import Clockwork
from sim_bridge.wheel_odometry import WheelOdometry
from sim_bridge.world.emulation import emulation_of
from sim_bridge.world.noise import generator_of
from sim_bridge.world.unicycle import Unicycle
from sim_bridge.world.world import World

_TRUTH_TICKS = 4  # 50 Hz
_COMMAND_TICKS = 10
_STATUS_TICKS = 200
_LANDING_LIMIT_S = 20.0


class Harness:
    """World, emulators and truth of one run. `close` releases everything, in any state."""

    def __init__(self, child: Child, order: LaunchSpec) -> None:
        own = [name for name in order.streams if name in order.site.drones]
        order = replace(order, scenario=with_bursts(order.scenario, order.site.drones, own, order.seed))
        self._child, self._order = child, order
        self.world = World(order.site, order.scenario, order.seed, order.real, order.unseen)
        self._followers: Followers | None = None
        self._stage = Stage(self.world)
        self._clock = Clockwork(time.monotonic_ns())
        self._commands = [child.bus.subscribe([SIM_COMMAND], entity=name) for name in self.world.targets]

    def open(self) -> None:
        """Take the ports, share the truth, start the cameras; returns when everything listens."""
        self._open_emulators()
        self._followers = Followers(self._order.site, self._order.real, self.world.puppets, self._child.bus)
        emulators = self._stage.emulators
        self._faults = FaultSchedule(self._order.scenario.faults, self.world, emulators)
        name = f"{os.getpid()}-{self._order.site.site}"
        self._stage.share_truth(name)
        order = self._order
        if order.streams:
            self._child.starting(f"{len(order.streams)} cameras")
            specs = render_specs(order.site, order.scenario, order.streams, name, order.seed, order.unseen)
            self._stage.open_cameras(specs, lambda: self._child.stop_requested)

    def run(self) -> None:
        """Run until told to stop; after the supervisor's end, until every drone has landed (20 s at most)."""
        self._child.ready(self._inventory)
        gc.collect()
        go_first()  # real drones do not wait for this machine
        gc.freeze()  # objects of the start live as long as the process: not collected
        self._clock = Clockwork(time.monotonic_ns())
        orphaned_ns = 0
        while not self._child.stop_requested:
            self._child.sleep_until(self._clock.next_deadline())
            now_ns = time.monotonic_ns()
            self._clock.begin(now_ns, matters=not self._all_landed())
            self.tick(self._clock.deadline_ns)
            self._child.beat()
            if self._clock.ticks % _COMMAND_TICKS == 0 and not self._child.supervisor_alive:
                orphaned_ns = orphaned_ns or now_ns
                if self._all_landed() or now_ns - orphaned_ns > _LANDING_LIMIT_S * 1e9:
                    self._publish_truth(self._clock.deadline_ns)  # the last state may be from before the touch-down
                    return

    def tick(self, stamp_ns: int) -> None:
        """Advance by 5 ms; stamp_ns: boot-clock time of the new states."""
        if self._followers is not None:
            self._followers.move(stamp_ns)
        self._stage.tick(stamp_ns)
        ticks = self.world.ticks
        if ticks % _TRUTH_TICKS == 0:
            self._publish_truth(stamp_ns)
        if ticks % _COMMAND_TICKS == 0:
            self._obey()
            self._break_things()
            self._tell_lost()
            self._stage.tell_cameras()
            if self._stage.cameras is not None:
                self._clock.count_pictures(*self._stage.cameras.pictures, matters=not self._all_landed())
            self._child.tick_status(self._clock.judged, self._clock.overruns)
        if ticks % _STATUS_TICKS == 0:
            self._publish_status()
            self._judge()

    def close(self) -> None:
        """Stop the cameras, close the ports, remove the truth; idempotent."""
        self._stage.close()
        if self._followers is not None:
            self._followers.close()
            self._followers = None

    def _open_emulators(self) -> None:
        order, world = self._order, self.world
        body_at = exchanged(order.scenario.faults)
        for name in world.drones:
            body = body_at.get(name, name)
            emulation = emulation_of(order.site.drones[name].kind)
            emulator = emulation.open(name, world.drones[body], world.onboard.get(body), order)
            self._stage.add(name, emulator, emulator.fileno())
        targets = {odometry_name(name): name for name in world.targets}
        for name, place in order.captures.items():
            if name in targets:
                self._open_router(name, targets[name], place)
            else:
                self._open_capture(name, place)

    def _open_router(self, name: str, target: str, place: tuple[str, int]) -> None:
        order = self._order
        errors, odometry = order.scenario.cameras.mounting_errors, order.site.tracked[target].odometry
        assert odometry is not None
        wheels = WheelOdometry(self.world.targets[target], errors, generator_of_eye(order.seed, name))
        faults = [fault for fault in of_part(order.scenario.faults, Part.ODOMETRY) if fault.entity == target]
        router = OdometryRouter(name, place, odometry.source, wheels, faults)
        self._stage.add(name, router, router.fileno())

    def _open_capture(self, name: str, place: tuple[str, int]) -> None:
        order, world = self._order, self.world
        rng, errors = generator_of(order.seed, f"capture {name}"), order.scenario.cameras.mounting_errors
        if name in order.site.ranging:
            ranging, drones, faults = order.site.ranging[name], order.site.drones, order.scenario.faults
            radios = Radios(ranging, errors, rng, [fault for fault in faults if fault.entity == name])
            gateway = RangeGateway(name, place, ranging, world.bodies, drones, world.states, radios, faults)
            self._stage.add(name, gateway, gateway.fileno())
            return
        system = order.site.motion_capture[name]
        faults = order.scenario.faults
        seen = CapturedBodies(name, system, world.bodies, world.states, rng, faults, errors)
        if system.source.startswith("ros2://"):
            router = PoseRouter(name, place, seen)
            self._stage.add(name, router, router.fileno())
        else:
            server = NatnetEmulator(name, place, seen, MULTICAST_GROUP if order.scenario.natnet_multicast else "")
            self._stage.add(name, server, server.fileno())

    @property
    def _inventory(self) -> str:
        real = f", real: {', '.join(self._order.real)}" if self._order.real else ""
        return f"{len(self.world.drones)} drones, {len(self._order.streams)} cameras{real}"

    def _all_landed(self) -> bool:
        for drone in self.world.drones.values():
            if drone.autopilot.motors_on or drone.airborne:
                return False
        return not any(puppet.airborne for puppet in self.world.puppets.values())

    def _publish_truth(self, stamp_ns: int) -> None:
        bus, unseen = self._child.bus, self._order.unseen
        for name, row in zip(self.world.bodies, self.world.states().tolist(), strict=True):
            if name in unseen or math.isnan(row[0]):
                continue  # the tracker's estimate is no truth
            x, y, z, vx, vy, vz, roll, pitch, yaw, _, _, _, on_ground = row
            bus.publish(
                TRUTH,
                TruthState(
                    header=bus.header(name, stamp_ns),
                    position_m=(x, y, z),
                    velocity_m_s=(vx, vy, vz),
                    attitude_rad=(roll, pitch, yaw),
                    on_ground=on_ground > 0.5,
                ),
            )

    def _publish_status(self) -> None:
        clock, bus = self._clock, self._child.bus
        status = SimStatus(
            header=bus.header(self._child.name),
            ticks=clock.judged,
            overruns=clock.overruns,
            pictures=clock.pictures,
            late_pictures=clock.late_pictures,
            airborne=self.world.airborne,
        )
        bus.publish(SIM_STATUS, status)

    def _judge(self) -> None:
        """Report once what makes this run invalid, and once when that is over."""
        faults = self._clock.faults
        cameras = self._stage.cameras
        ended = cameras.ended() if cameras is not None else []
        faults += [f"the render process of {name} ended" for name in ended]
        if faults:
            self._child.degrade("; ".join(faults))
        else:
            self._child.ready(self._inventory)

    def _obey(self) -> None:
        for received in (one for commands in self._commands for one in commands.drain()):
            command, name = received.message, received.key.entity
            if isinstance(command, SimCommand) and not steer(self.world.targets[name], command):
                self._child.event(Severity.WARNING, f"order {command.action!r} to {name} not understood")

    def _tell_lost(self) -> None:
        for entity, line in self._followers.news() if self._followers is not None else ():
            severity = Severity.INFO if line in GOOD_NEWS else Severity.WARNING
            self._child.event(severity, line, "", entity)

    def _break_things(self) -> None:
        for entity, line in self._faults.apply(self.world.time_s, bool(self.world.airborne)):
            self._child.event(Severity.WARNING, line, "", entity, injected=True)


def steer(target: Unicycle, command: SimCommand) -> bool:
    """Obey a command to a target: drive, stop, path, place; returns whether it was understood."""
    match command.action:
        case "drive":
            target.drive(command.speed_m_s, command.turn_rate_rad_s)
        case "stop":
            target.drive(0.0, 0.0)
        case "path":
            target.follow_path()
        case "place" if command.position_m is not None:
            target.place(command.position_m[0], command.position_m[1])
        case _:
            return False
    return True
