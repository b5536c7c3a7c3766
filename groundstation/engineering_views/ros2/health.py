"""Health of vehicles, cameras and processes, and events, for ROS 2 tools: batteries, diagnostics, /rosout."""

import math

import numpy as np

from groundstation.bus import messages as m
from groundstation.engineering_views.ros2.codec import Ros2Codec, RosMessage
from groundstation.engineering_views.ros2.geometry import Builder
from groundstation.engineering_views.ros2.names import own

# WIRE (docs/reference/ros2.md 3): diagnostic_msgs/msg/DiagnosticStatus and rcl_interfaces/msg/Log.
_OK, _WARN, _ERROR = 0, 1, 2
_LOG_LEVEL = {m.Severity.INFO: 20, m.Severity.WARNING: 30, m.Severity.ERROR: 40}
_GRAVE = frozenset({m.FlightState.LOST, m.FlightState.EMERGENCY})
_LIPO = 3
BATTERY = "sensor_msgs/msg/BatteryState"
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
LOG = "rcl_interfaces/msg/Log"


class HealthMaker:
    """Makes the messages on the health of vehicles, cameras and processes."""

    def __init__(self, codec: Ros2Codec) -> None:
        self._codec, self._build, self._make = codec, Builder(codec), codec.make

    def vehicle(self, stamp_ns: int, status: m.VehicleStatus) -> list[RosMessage]:
        """Return battery and diagnostics of a vehicle."""
        name = status.header.entity
        level = _ERROR if status.flight_state in _GRAVE else _WARN if status.detail else _OK
        facts = {
            "flight state": status.flight_state,
            "link": "unknown" if status.link_quality is None else f"{status.link_quality:.2f}",
            "telemetry": f"{status.rate_hz:.1f} Hz",
        }
        text = f"{status.mode} {status.detail}".strip()
        return [self._battery(stamp_ns, name, status.battery), self._diagnostics(stamp_ns, name, level, text, facts)]

    def camera(self, stamp_ns: int, status: m.CameraStatus) -> RosMessage:
        """Return the diagnostics of a camera."""
        facts = {"pictures": f"{status.fps:.1f} per second", "age": f"{status.age_ms:.0f} ms"}
        level = _OK if status.connected else _ERROR
        return self._diagnostics(stamp_ns, status.header.entity, level, status.detail or "connected", facts)

    def process(self, stamp_ns: int, status: m.ProcessStatus) -> RosMessage:
        """Return the diagnostics of a process."""
        level = _WARN if status.state is m.Lifecycle.DEGRADED else _OK
        facts = {"cpu": f"{status.cpu:.2f}", "overruns": f"{status.overruns} of {status.ticks}"}
        name = f"process {status.header.entity}"  # the supervisor reports for those that are not up
        return self._diagnostics(stamp_ns, name, level, f"{status.state} {status.detail}".strip(), facts)

    def event(self, stamp_ns: int, event: m.Event) -> RosMessage:
        """Return a line of the log."""
        return self._codec.message(
            "/rosout",
            LOG,
            stamp=self._build.time(stamp_ns),
            level=_LOG_LEVEL[event.severity],
            name=f"skein.{event.header.entity}",
            msg=f"{event.text} ({event.remedy})" if event.remedy else event.text,
            file="",
            function="",
            line=0,
        )

    def _battery(self, stamp_ns: int, name: str, share: float | None) -> RosMessage:
        unmeasured = dict.fromkeys(
            ("voltage", "temperature", "current", "charge", "capacity", "design_capacity"), math.nan
        )
        return self._codec.message(
            own(f"{name}/battery"),
            BATTERY,
            header=self._build.header(stamp_ns, name),
            **unmeasured,
            percentage=math.nan if share is None else float(share),
            power_supply_status=0,
            power_supply_health=0,
            power_supply_technology=_LIPO,
            present=True,
            cell_voltage=np.zeros(0, np.float32),
            cell_temperature=np.zeros(0, np.float32),
            location="",
            serial_number="",
        )

    def _diagnostics(self, stamp_ns: int, name: str, level: int, text: str, facts: dict[str, str]) -> RosMessage:
        status = self._make(
            "diagnostic_msgs/msg/DiagnosticStatus",
            level=level,
            name=f"skein: {name}",
            message=text,
            hardware_id=name,
            values=[self._make("diagnostic_msgs/msg/KeyValue", key=key, value=str(v)) for key, v in facts.items()],
        )
        return self._codec.message("/diagnostics", DIAGNOSTICS, header=self._build.header(stamp_ns), status=[status])
