"""The other processes of `groundstation bench bus`: `router ENDPOINT FOLDER`, or `echo` with both for each bus.

FOLDER holds the certificates; "-" for a plain bus. Each prints "ready" and ends with its standard input.
"""

import os
import select
import sys
import threading
import time

from groundstation.bus.access import AccessList
from groundstation.bus.messages import Odometry, VelocitySetpoint
from groundstation.bus.roles import Identity, Member, Role
from groundstation.bus.topics import ODOMETRY, SETPOINT
from groundstation.bus.zenoh_bus import ZenohBus, open_bus, open_router
from groundstation.runtime.router_refusals import RouterRefusals

SITE, DRONE = "bench", "drone_1"
TRACKER, DRIVER = Member("tracker", Role.TRACKER, ("tracker",)), Member(DRONE, Role.DRIVER, (DRONE,), (DRONE,))
ROUTER = "router"
_TURN_S = 0.05


def identity(folder: str, name: str) -> Identity | None:
    """Return a member's identity, None for a plain bus."""
    return None if folder == "-" else Identity(folder, name, "bench")


def route(endpoint: str, folder: str) -> None:
    """Run a router until standard input ends, as in a run: a guarded one traces refusals, and reads its trace."""
    access = None if folder == "-" else AccessList(SITE, (TRACKER, DRIVER))
    ready = os.fdopen(os.dup(1), "w")
    refusals = RouterRefusals()
    router = open_router(endpoint, identity(folder, ROUTER), access, trace=True)
    print("ready", file=ready, flush=True)
    while not select.select([sys.stdin], [], [], _TURN_S)[0]:
        refusals.take(time.monotonic_ns())
    router.close()
    refusals.close()


def echo(ways: list[tuple[str, str]]) -> None:
    """Answer each setpoint at once, on every bus, with an odometry message of the size in flight."""
    buses = [open_bus(endpoint, SITE, DRONE, 5.0, identity(folder, DRONE)) for endpoint, folder in ways]
    for bus in buses:
        threading.Thread(target=_answer, args=(bus,), daemon=True).start()
    print("ready", flush=True)
    sys.stdin.read()
    for bus in buses:
        bus.close()


def _answer(bus: ZenohBus) -> None:
    setpoints = bus.subscribe([SETPOINT], entity=DRONE)
    while True:
        setpoints.wait(1.0)
        for received in setpoints.drain():
            if isinstance(received.message, VelocitySetpoint):
                header = bus.header(DRONE, received.message.header.stamp_ns)
                answer = Odometry(
                    header=header,
                    velocity_m_s=(0.1, 0.2, 0.0),
                    velocity_covariance=(0.01,) * 9,
                    yaw_rad=0.3,
                    roll_rad=0.0,
                    pitch_rad=0.0,
                )
                bus.publish(ODOMETRY, answer)


if __name__ == "__main__":
    if sys.argv[1] == ROUTER:
        route(*sys.argv[2:4])
    else:
        echo(list(zip(sys.argv[2::2], sys.argv[3::2], strict=True)))
