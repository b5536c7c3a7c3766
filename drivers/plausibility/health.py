"""Vocabulary of plausibility: sensors, their health, and findings about them."""

from dataclasses import dataclass
from enum import IntEnum, StrEnum

# Weight of a SUSPECT velocity.
SUSPECT_VELOCITY_STD_M_S = 0.5


class Health(IntEnum):
    """How far a sensor can be trusted; a BAD one counts as silent."""

    GOOD = 0
    SUSPECT = 1
    BAD = 2


class Sensor(StrEnum):
    """A judged sensor; TELEMETRY: all values together."""

    TELEMETRY = "telemetry"
    CLOCK = "clock"
    VELOCITY = "velocity"
    ATTITUDE = "attitude"
    IMU = "IMU"


@dataclass(frozen=True, slots=True)
class Finding:
    """Health of a sensor, with the reason in words for the operator."""

    sensor: Sensor
    health: Health
    reason: str


@dataclass(frozen=True, slots=True)
class HealthReport:
    """Findings on all sensors that are not GOOD, the worst first.

    withheld: the newest velocity is not to be used, whatever the health: it cannot be true, or nothing confirms it yet.
    """

    findings: tuple[Finding, ...] = ()
    withheld: bool = False

    def of(self, *sensors: Sensor) -> Health:
        """Return the worst health of some sensors."""
        if not self.findings:  # as in most reports; called several times per packet
            return Health.GOOD
        return max((one.health for one in self.findings if one.sensor in sensors), default=Health.GOOD)

    def reason(self, health: Health, sensors: frozenset[Sensor]) -> str:
        """Return the first reason why one of the sensors is at least this bad, or ""."""
        return next((one.reason for one in self.findings if one.health >= health and one.sensor in sensors), "")


ALL_GOOD = HealthReport()
