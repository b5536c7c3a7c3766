"""Fake flight on a real Zenoh router: two drones, a target, plans, pictures and answers to commands."""

import math
import threading
import time

import numpy as np
from fake_pictures import paint
from fake_plan import TARGET, plan_at
from fake_words import LEVEL, STATES, WHY
from free_port import free_port

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus import zenoh_bus

DRONES = ("drone_1", "drone_2")
TURN_S, DESCENT_M_S = 0.02, 0.3
ANGLES = (2.2, 0.0, 4.3, 0.73, 1.47, 2.93, 3.6, 5.2)  # bearings of the drones from the target, far enough apart


class FakeFlight(threading.Thread):
    """Publishes until `stop`; `frozen` silences the tracker, `deaf` drones answer nothing."""

    def __init__(
        self, drones: tuple[str, ...] = DRONES, cameras: tuple[str, ...] = ("ceiling",), endpoint: str = ""
    ) -> None:
        super().__init__(daemon=True)
        self.drones, self.cameras = drones, cameras
        self.endpoint = endpoint or f"tcp/127.0.0.1:{free_port()}"
        self._router = zenoh_bus.open_router(self.endpoint)
        self._session = zenoh_bus.open_bus(self.endpoint, "lab", "fake")._session
        self._buses: dict[str, zenoh_bus.ZenohBus] = {}
        self.modes = dict.fromkeys(drones, "TRACK")
        self.battery: dict[str, float | None] = {"drone_1": 0.82, "drone_2": 0.34}
        self.link: dict[str, float | None] = {}
        self.rate_hz: dict[str, float] = {}
        self.detail: dict[str, str] = {}
        self.lands_in_s: dict[str, float] = {}
        self.braked: set[str] = set()
        self.unseen_s: dict[str, float] = {}  # seconds since the target was last observed
        self.unplaced_s: dict[str, float] = {}  # seconds for which what is seen has contradicted the estimate
        self.deaf: set[str] = set()
        self._sunk_m = dict.fromkeys(drones, 0.0)  # descent of each landing drone so far
        self.frozen = self.fenced = False
        self.dark = False  # no camera has enough light
        self.states: dict[str, m.FlightState] = {}  # those that do not follow from the mode
        self.mute: set[str] = set()  # drones without telemetry
        self.findings: tuple[m.PreflightFinding, ...] = ()  # findings of the pre-flight checks
        self.distance_m = 1.3  # distance of the drones from the target
        self.lease = True
        self.commands: list[m.Command] = []
        self.steered: list[m.SimCommand] = []
        self._later: list[tuple[float, str, m.Command, m.AckStage]] = []
        self._over = threading.Event()
        self.began = time.monotonic()

    def bus(self, source: str) -> zenoh_bus.ZenohBus:
        return self._buses.setdefault(source, zenoh_bus.ZenohBus(self._session, "lab", source))

    def run(self) -> None:
        orders = self.bus("drone_1").subscribe([t.COMMAND])
        steering = self.bus("sim_bridge").subscribe([t.SIM_COMMAND])
        tick, due = 0, time.monotonic()
        while not self._over.is_set():
            self._turn(tick, time.monotonic() - self.began)
            for received in orders.drain():
                if isinstance(received.message, m.Command):
                    self._obey(received.message)
            self.steered += [r.message for r in steering.drain() if isinstance(r.message, m.SimCommand)]
            self._answer()
            tick += 1
            due += TURN_S
            time.sleep(max(0.0, due - time.monotonic()))

    def finish(self) -> None:
        """Publish nothing more; subscribers stay connected."""
        self._over.set()
        self.join(5)

    def stop(self) -> None:
        self.finish()
        self._session.close()
        self._router.close()

    # -- where everything is ---

    def target_at(self, s: float) -> tuple[float, float, float, float]:
        w = 0.11
        return (
            2.4 * math.sin(w * s),
            1.0 * math.sin(2 * w * s),
            2.4 * w * math.cos(w * s),
            2.0 * w * math.cos(2 * w * s),
        )

    def drone_at(self, name: str, s: float) -> tuple[float, float, float, float]:
        tx, ty, *_ = self.target_at(s)
        angle = 0.12 * s + ANGLES[self.drones.index(name)]
        px, py = 0.75 * tx + self.distance_m * math.cos(angle), 0.75 * ty + self.distance_m * math.sin(angle)
        height = {"drone_1": 2.1, "drone_3": 1.6}.get(name, 1.2) - self._sunk_m[name]
        return px, py, max(0.0, height) if name in self.flying() else 0.0, math.atan2(ty - py, tx - px)

    def _sink(self) -> None:
        for name, mode in self.modes.items():
            self._sunk_m[name] = self._sunk_m[name] + TURN_S * DESCENT_M_S if mode == "LANDING" else 0.0

    def sees(self, observer: str, subject: str) -> bool:
        """Return whether this observer is in flight and has this subject in view."""
        here = observer not in self.drones or observer in self.flying()
        return here and subject not in self.unseen_s

    def flying(self) -> list[str]:
        return [name for name in self.drones if self.modes[name] not in ("LANDED", "CUT", "CONNECTING")]

    # -- publishing ---

    def _turn(self, tick: int, s: float) -> None:
        self._sink()
        self._say_truth(s)
        if not self.frozen:
            self._say_estimate(s)
            if tick % 5 == 0:
                self._say_plan(s)
            if tick % 4 == 0:
                self._say_innovations(s, tick)
        if tick % 3 == 0:
            self._see(s, tick)
        if tick % 10 == 0:
            self._say_vehicles(s)
        if tick % 25 == 0:
            self._say_slow(s, tick)

    def _say_truth(self, s: float) -> None:
        bus = self.bus("sim_bridge")
        x, y, vx, vy = self.target_at(s)
        poses = {TARGET: (x, y, 0.0, math.atan2(vy, vx)), **{name: self.drone_at(name, s) for name in self.drones}}
        for name, (px, py, pz, yaw) in poses.items():
            state = m.TruthState(
                header=bus.header(name),
                position_m=(px, py, pz),
                velocity_m_s=(0.0, 0.0, 0.0),
                attitude_rad=(0.0, 0.0, yaw),
                on_ground=name in self.drones and name not in self.flying(),
            )
            bus.publish(t.TRUTH, state)

    def _say_estimate(self, s: float) -> None:
        bus = self.bus("tracker")
        entities = []
        for index, name in enumerate(self.flying()):
            x, y, z, yaw = self.drone_at(name, s)
            a, b, c = 0.004 + 0.002 * math.sin(s), 0.0015 * (1 - 2 * (index % 2)), 0.003
            cov = [0.0] * 16
            cov[0], cov[1], cov[4], cov[5], cov[10], cov[15] = a, b, b, c, 0.001, 0.002
            mean = (x + 0.04 * math.sin(3 * s), y + 0.04 * math.cos(2 * s), z, yaw)
            unseen_s, unplaced_s = self.unseen_s.get(name, 0.05), self.unplaced_s.get(name, 0.0)
            speed, wrong = (0.2, 0.1, 0.0), unplaced_s > 0.0
            told = m.EntityEstimate(name, "robot", mean, tuple(cov), speed, True, unseen_s, unplaced_s, wrong)
            entities.append(told)
        x, y, vx, vy = self.target_at(s)
        place = (x + 0.06 * math.sin(1.3 * s), y + 0.05 * math.cos(1.1 * s))
        spread = (0.012 + 0.008 * math.sin(0.4 * s), 0.004, 0.004, 0.008)
        age_s = self.unseen_s.get(TARGET, 0.1)
        entities.append(m.EntityEstimate(TARGET, "target", place, spread, (vx, vy), True, age_s))
        bus.publish(t.ESTIMATE, m.Estimate(header=bus.header("team"), entities=tuple(entities), epoch=1))
        for name in self.drones:
            setpoint = m.VelocitySetpoint(
                header=bus.header(name),
                velocity_m_s=(0.35 if name == "drone_1" else 0.1, 0.15, 0.0),
                yaw_rate_rad_s=0.1,
                lifetime_ms=300,
                epoch=1,
            )
            bus.publish(t.SETPOINT, setpoint)

    def _say_plan(self, s: float) -> None:
        bus, up = self.bus("tracker"), self.flying()
        bus.publish(t.PLAN, plan_at(s, bus.header("team"), up, self.cameras, self.sees, self.fenced))

    def _say_innovations(self, s: float, tick: int) -> None:
        bus = self.bus("tracker")
        rng = np.random.default_rng(tick)
        for observer, subject, size in (("ceiling", "drone_1", 4), ("drone_1", TARGET, 3), ("drone_2", TARGET, 3)):
            late = tick % 60 == 0 and subject == TARGET
            innovation = m.Innovation(
                header=bus.header(observer),
                observer=observer,
                subject=subject,
                verdict=m.Verdict.LATE if late else m.Verdict.ACCEPTED,
                residual=(0.01,) * size,
                nis=None if late else float(rng.chisquare(size)),
                latency_ms=140.0,
            )
            bus.publish(t.INNOVATION, innovation)

    def _see(self, s: float, tick: int) -> None:
        stamp_ns = time.monotonic_ns() - 20_000_000
        for name in self.drones:
            at = (0.15 * math.sin(s), 0.1 * math.cos(s), 1.6)
            self._observe(name, f"{name}_camera", TARGET, at, stamp_ns)
            if tick % 12 == 0:
                board = None if TARGET in self.unseen_s else at
                self._picture(f"{name}_camera", (640, 360), 460.0, board, stamp_ns)
        for camera in self.cameras:
            for name in self.drones:
                x, y, z, _ = self.drone_at(name, s)
                self._observe(camera, camera, name, (x, -y, 4.2 - z), stamp_ns)
            if tick % 12 == 0:
                x, y, z, _ = self.drone_at(self.drones[0], s)
                board = (x, -y, 4.2 - z) if self.sees(camera, self.drones[0]) else None
                self._picture(camera, (1280, 720), 1179.0, board, stamp_ns)

    def _observe(self, observer: str, camera: str, subject: str, at: tuple[float, float, float], stamp_ns: int) -> None:
        if not self.sees(observer, subject):
            return
        bus = self.bus(camera)
        observation = m.RelativeObservation(
            header=bus.header(observer, stamp_ns),
            observer=observer,
            subject=subject,
            camera=camera,
            position_m=at,
            yaw_rad=0.0,
            covariance=(1e-4,) * 16,
            margin=3.0,
        )
        bus.publish(t.OBSERVATION, observation)

    def _picture(
        self, camera: str, size: tuple[int, int], focal: float, at: tuple[float, float, float] | None, stamp_ns: int
    ) -> None:
        bus = self.bus(camera)
        bus.publish_bytes(t.IMAGE, bus.header(camera, stamp_ns), paint(size, focal, at))

    def _say_vehicles(self, s: float) -> None:
        for name in (name for name in self.drones if name not in self.mute):
            bus, mode = self.bus(name), self.modes[name]
            status = m.VehicleStatus(
                header=bus.header(name),
                flight_state=self.states.get(name, STATES.get(mode, m.FlightState.FLYING)),
                mode=mode,
                battery=self.battery.get(name),
                link_quality=self.link.get(name, 0.93),
                rate_hz=self.rate_hz.get(name, 198.0 + math.sin(s)),
                detail=self.detail.get(name, WHY.get(mode, "")),
                braked=name in self.braked,
                lands_in_s=self.lands_in_s.get(name),
            )
            bus.publish(t.VEHICLE_STATUS, status)

    def _say_slow(self, s: float, tick: int) -> None:
        bus = self.bus("supervisor")
        if self.findings:
            bus.publish(t.PREFLIGHT, m.Preflight(header=bus.header("team"), findings=self.findings))
        if self.lease:
            header = bus.header("team")
            bus.publish(t.LEASE, m.Lease(header=header, holder="operator", expires_ns=header.stamp_ns + 1_500_000_000))
        for name in ("tracker", "recorder", *self.drones, *self.cameras, "sim_bridge"):
            bus = self.bus(name)
            status = m.ProcessStatus(
                header=bus.header(name), state=m.Lifecycle.READY, pid=1, cpu=0.12, ticks=tick + 1, overruns=0
            )
            bus.publish(t.PROCESS_STATUS, status)
        for name in (*self.cameras, *(f"{name}_camera" for name in self.drones)):
            bus = self.bus(name)
            status_of_camera = m.CameraStatus(
                header=bus.header(name),
                connected=True,
                fps=15.0,
                age_ms=131.0,
                frames=tick,
                skipped=0,
                detections=tick,
                brightness=0.02 if self.dark else None,
            )
            bus.publish(t.CAMERA_STATUS, status_of_camera)
        if tick % 250 == 0:
            self.event(m.Severity.INFO, "turtlebot localised by drone_1")

    def event(self, severity: m.Severity, text: str, entity: str = "tracker", remedy: str = "") -> None:
        bus = self.bus("tracker")
        bus.publish(t.EVENT, m.Event(header=bus.header(entity), severity=severity, text=text, remedy=remedy))

    # -- commands ---

    def _obey(self, command: m.Command) -> None:
        # As a driver does: a repeated command is answered again, since the first answers may have been lost.
        if all(known.id != command.id for known in self.commands):
            self.commands.append(command)
        now = time.monotonic()
        starts = "operator" in command.scope
        names = [name for name in command.scope or self.drones if name in self.drones]
        if not starts:
            for name in names:
                for delay, stage in enumerate((m.AckStage.RECEIVED, m.AckStage.ACCEPTED, m.AckStage.EFFECTIVE)):
                    self._later.append((now + 0.15 * delay, name, command, stage))
            return
        for delay, stage in enumerate((m.AckStage.RECEIVED, m.AckStage.ACCEPTED, m.AckStage.EFFECTIVE)):
            self._later.append((now + 0.2 * delay, "operator", command, stage))
        for name in names or self.drones:
            self.modes[name] = LEVEL.get(command.verb, "HOVER")

    def _answer(self) -> None:
        now = time.monotonic()
        for entry in [entry for entry in self._later if entry[0] <= now]:
            self._later.remove(entry)
            _, name, command, stage = entry
            if name in self.deaf:
                continue
            bus = self.bus(name)
            ack = m.CommandAck(header=bus.header(name), command_id=command.id, verb=command.verb, stage=stage)
            bus.publish(t.COMMAND_ACK, ack)
            if name in self.modes:
                landing = command.verb is m.Verb.LAND and stage is not m.AckStage.EFFECTIVE
                self.modes[name] = "LANDING" if landing else LEVEL.get(command.verb, "HOVER")
