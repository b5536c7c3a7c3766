"""A team that only sends: topics, rates and sizes of a flight, stamped when sent, for `bench console`."""

import math
import threading
import time
from random import Random

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.api import Bus

RATE_HZ = 50
TARGET = "turtlebot"
CAMERA = "ceiling"
_PLAN_EVERY, _SIGHT_EVERY, _STATUS_EVERY, _SLOW_EVERY = 5, 4, 10, 50
_COVARIANCE = (4e-3, 1e-3, 0.0, 0.0, 1e-3, 3e-3, 0.0, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 0.0, 2e-3)


class TalkingTeam(threading.Thread):
    """Publishes until `over`: estimates, setpoints and truth at 50 Hz, everything else at its own rate.

    jpegs: by camera, the pictures that it sends in turn at 5 Hz.
    """

    def __init__(self, bus: Bus, drones: tuple[str, ...], jpegs: dict[str, list[bytes]]) -> None:
        super().__init__(daemon=True)
        self.over = threading.Event()
        self._bus, self._drones, self._jpegs = bus, drones, jpegs
        self._random = Random(1)

    def run(self) -> None:
        """Publish on a grid of time; missed messages are not sent later."""
        tick, due_s = 0, time.monotonic()
        while not self.over.is_set():
            self._turn(tick, time.monotonic())
            tick += 1
            due_s = max(due_s + 1.0 / RATE_HZ, time.monotonic() - 1.0 / RATE_HZ)
            time.sleep(max(0.0, due_s - time.monotonic()))

    def _turn(self, tick: int, now_s: float) -> None:
        self._decide(now_s)
        if tick % _PLAN_EVERY == 0:
            self._plan()
        if tick % _SIGHT_EVERY == 0:
            self._see()
        if tick % _STATUS_EVERY == 0:
            self._pictures(tick // _STATUS_EVERY)
            self._vehicles()
        if tick % _SLOW_EVERY == 0:
            self._slow(tick)

    def _place(self, name: str, now_s: float) -> tuple[float, float, float]:
        index = (*self._drones, TARGET).index(name)
        angle, noise = 0.2 * now_s + 1.3 * index, self._random.uniform(-0.01, 0.01)
        return 2.0 * math.cos(angle) + noise, 1.5 * math.sin(angle) + noise, 0.0 if name == TARGET else 1.5

    def _decide(self, now_s: float) -> None:
        entities = []
        for name in (*self._drones, TARGET):
            x, y, z = self._place(name, now_s)
            truth = m.TruthState(
                header=self._bus.header(name), position_m=(x, y, z), velocity_m_s=(0.1, 0.2, 0.0),
                attitude_rad=(0.0, 0.0, 0.3), on_ground=False,
            )  # fmt: skip
            self._bus.publish(t.TRUTH, truth)
            if name == TARGET:
                entities.append(m.EntityEstimate(name, "target", (x, y), (4e-3, 0, 0, 3e-3), (0.1, 0.2), True, 0.1))
            else:
                mean = (x, y, z, 0.3)
                entities.append(m.EntityEstimate(name, "robot", mean, _COVARIANCE, (0.1, 0.2, 0.0), True, 0.1))
        self._bus.publish(t.ESTIMATE, m.Estimate(header=self._bus.header("team"), entities=tuple(entities), epoch=1))
        for name in self._drones:
            speed = self._random.uniform(0.1, 0.5)
            setpoint = m.VelocitySetpoint(
                header=self._bus.header(name), velocity_m_s=(speed, 0.1, 0.0), yaw_rate_rad_s=0.1, lifetime_ms=300,
                epoch=1,
            )  # fmt: skip
            self._bus.publish(t.SETPOINT, setpoint)

    def _plan(self) -> None:
        chosen, cost = ",".join(self._drones), self._random.uniform(0.01, 0.02)
        edges = [m.Edge(CAMERA, name, 800.0) for name in self._drones]
        edges += [m.Edge(name, TARGET, 100.0 + 99.0 * cost) for name in self._drones]
        plan = m.Plan(
            header=self._bus.header("team"),
            topology=chosen,
            cost=cost,
            controls=tuple(m.Control(name, (0.3, 0.1, 0.0), 0.1, ("fence",), (0.5, 0.2, 0.0)) for name in self._drones),
            edges=tuple(edges),
            alternatives=tuple(m.Alternative("/".join(self._drones[k:]), cost * (2 + k)) for k in range(8)),
            solver=m.SolverReport("converged", 84, 0.018, 24, 2),
            mode="TRACK",
        )
        self._bus.publish(t.PLAN, plan)

    def _see(self) -> None:
        for name in self._drones:
            for observer, subject in ((CAMERA, name), (name, TARGET)):
                header = self._bus.header(observer)
                sight = m.RelativeObservation(
                    header=header, observer=observer, subject=subject, position_m=(0.1, 0.1, 2.0), yaw_rad=0.0,
                    camera=CAMERA if observer == CAMERA else f"{name}_camera", covariance=(1e-4,) * 16,
                )  # fmt: skip
                self._bus.publish(t.OBSERVATION, sight)
                innovation = m.Innovation(
                    header=header, observer=observer, subject=subject, verdict=m.Verdict.ACCEPTED,
                    residual=(0.01,) * 3, nis=self._random.uniform(1.0, 5.0), latency_ms=140.0,
                )  # fmt: skip
                self._bus.publish(t.INNOVATION, innovation)

    def _pictures(self, number: int) -> None:
        for camera, jpegs in self._jpegs.items():
            self._bus.publish_bytes(t.IMAGE, self._bus.header(camera), jpegs[number % len(jpegs)])

    def _vehicles(self) -> None:
        for name in self._drones:
            status = m.VehicleStatus(
                header=self._bus.header(name), flight_state=m.FlightState.FLYING, mode="TRACK", battery=0.7,
                link_quality=self._random.uniform(0.9, 1.0), rate_hz=197.0,
            )  # fmt: skip
            self._bus.publish(t.VEHICLE_STATUS, status)

    def _slow(self, tick: int) -> None:
        header = self._bus.header("team")
        self._bus.publish(t.LEASE, m.Lease(header=header, holder="operator", expires_ns=header.stamp_ns + 2 * 10**9))
        for name in ("tracker", "recorder", CAMERA, *self._drones):
            status = m.ProcessStatus(
                header=self._bus.header(name), state=m.Lifecycle.READY, pid=1, cpu=0.1, ticks=tick + 1, overruns=0
            )
            self._bus.publish(t.PROCESS_STATUS, status)
        for camera in self._jpegs:
            camera_status = m.CameraStatus(
                header=self._bus.header(camera), connected=True, fps=15.0, age_ms=130.0, frames=tick, skipped=0,
                detections=tick,
            )  # fmt: skip
            self._bus.publish(t.CAMERA_STATUS, camera_status)
