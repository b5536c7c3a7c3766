"""The process table: one row per kind of process, with the reasons for its limits. Times in seconds.

A run completes the rows with its sections and addresses (`groundstation/flight/composition.py`).
"""

import sys

from groundstation.process.priority import LARGEST
from groundstation.supervisor.process_spec import ProcessSpec, Restart, StopOrder

# Shares of a fully loaded processor, each a third of the one before (docs/decisions/0137).
_WAITED_FOR, _NEEDED, _LAST = LARGEST, LARGEST + 5, LARGEST + 10

GUARDIAN = ProcessSpec(
    name="guardian",
    role="guardian",
    entry="groundstation.supervisor.guardian:run",
    nice=_WAITED_FOR,
    stop_order=StopOrder.GUARDS,
    on_bus=False,  # it needs no other process
)
ROUTER = ProcessSpec(
    name="router",
    role="router",
    entry="groundstation.runtime.router:run",
    # Drones continue by themselves after pauses below 0.5 s; a router must not come back that soon.
    restart_delay_s=0.5,
    # Under a flood it forwards, and beats late; without it drones hover and land by themselves.
    hang_limit_s=2.0,
    nice=_WAITED_FOR,  # with an ordinary share it delayed setpoints by 0.7 s
    stop_order=StopOrder.CONNECTS,
    on_bus=False,
)
SIM_BRIDGE = ProcessSpec(
    name="sim_bridge",
    role="sim_bridge",
    command=(sys.executable, "-m", "sim_bridge", "--spec", "{spec}"),  # never imported by flight processes
    restart=Restart.ENDS_RUN,  # a new one would put the drones back on their pads
    hang_limit_s=5.0,
    nice=_WAITED_FOR,  # it emulates the drones
    stop_order=StopOrder.EMULATES,  # drivers land on it first
)
TRACKER = ProcessSpec(
    name="tracker",
    role="tracker",
    entry="groundstation.runtime.tracker_process:run",
    numbered=True,  # drivers obey the newest tracker, and hover until the operator resumes
    kernels=True,
    start_limit_s=180.0,  # a restarted one compiles kernels that somebody deleted meanwhile
    hang_limit_s=0.5,  # as long as a drone flies on without setpoints
    nice=_WAITED_FOR,  # a bus thread that holds the interpreter and has no processor keeps a tick waiting
    stop_order=StopOrder.DECIDES,
)
RECORDER = ProcessSpec(
    name="recorder",
    role="recorder",
    entry="groundstation.runtime.recorder:run",
    nice=_NEEDED,  # one that waits for 5 s is restarted, and recordings matter most on a full machine
    silence_limit_s=5.0,
    hang_limit_s=5.0,  # nobody flies by it, and a slow disk is no fault of its own
    stop_order=StopOrder.RECORDS,
    stop_limit_s=8.0,  # it writes the rest, and the index
)
DIAGNOSIS = ProcessSpec(
    name="diagnosis",
    role="diagnosis",
    entry="groundstation.diagnosis.process:run",
    required=False,  # nobody flies by it
    awaited=False,  # its first verdict needs seconds of flight
    start_limit_s=180.0,  # its models take seconds to import with the little that a full machine leaves
    nice=_LAST,
    silence_limit_s=5.0,
    hang_limit_s=10.0,  # a verdict on many robots holds the interpreter
    stop_order=StopOrder.DECIDES,
)
DRONE = ProcessSpec(  # name and entry are those of the drone
    name="",
    role="driver",
    required=False,  # the others can fly without it
    nice=_WAITED_FOR,  # the bus thread brings its setpoints: without them it lands its drone
    stop_order=StopOrder.DRIVES,
    stop_limit_s=12.0,  # it lands before it ends
)
CAMERA = ProcessSpec(  # name and entry are those of the camera
    name="",
    role="camera",
    required=False,
    hang_limit_s=2.0,  # a decoder may stall for longer than a drone may be left alone
    nice=_NEEDED,  # drones without pictures land; but it could use any amount of CPU
    stop_order=StopOrder.DRIVES,
)
TARGET = ProcessSpec(  # name and entry are those of the driver of a target's odometry
    name="",
    role="target",
    required=False,  # cameras track the target
    hang_limit_s=2.0,
    nice=_NEEDED,  # late reports are refused
    stop_order=StopOrder.DRIVES,
)
LIAISON = ProcessSpec(  # name is that of the other host
    name="",
    role="liaison",
    entry="groundstation.runtime.liaison:run",
    required=False,  # the devices of this host do without it
    nice=_WAITED_FOR,  # setpoints go through it
    stop_limit_s=30.0,  # the drones there land before it ends
)
CONSOLE = ProcessSpec(
    name="console",
    role="console",
    entry="groundstation.console.process:run",
    required=False,
    nice=_NEEDED,  # a stop clicked on the page goes through it
    silence_limit_s=5.0,
    hang_limit_s=5.0,
    shows_end=True,
    stop_limit_s=6.0,  # open pages fetch the report
)
MONITOR = ProcessSpec(
    name="monitor",
    role="monitor",
    entry="groundstation.runtime.monitor:run",
    nice=_LAST,
    silence_limit_s=5.0,
    hang_limit_s=5.0,
    stop_order=StopOrder.DECIDES,  # the operator has the terminal back before the shut-down writes on it
    on_terminal=True,
)
ROWS = (GUARDIAN, ROUTER, SIM_BRIDGE, TRACKER, DIAGNOSIS, RECORDER, DRONE, CAMERA, TARGET, LIAISON, CONSOLE, MONITOR)
