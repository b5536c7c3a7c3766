"""The section `mavlink` of a scenario: errors of emulated MAVLink vehicles; their kind names it."""

from typing import Annotated

from pydantic import AfterValidator, Field

from sim_bridge.section import Section
from sim_bridge.target_paths import rising

Gain = Annotated[float, Field(ge=0.3, le=1.5)]
Share = Annotated[float, Field(ge=0, le=1)]


class CopterScenario(Section):
    """Every emulated MAVLink vehicle: errors of its inertial sensors, battery, disturbances."""

    configured: bool = True
    """true: the vehicle has the parameters that indoor flight needs; false: those of the factory."""
    attitude_noise_deg: Annotated[float, Field(ge=0, le=5)] = 0.3
    """Noise of roll and pitch, one sigma [deg]."""
    velocity_gain: Annotated[tuple[Gain, Gain], AfterValidator(rising)] | None = None
    """Velocity that is reached divided by the one asked for; none: as each firmware on average, PX4 0.85, ArduPilot
    1."""
    hover_drift_m_s: Annotated[float, Field(ge=0, le=2)] = 0.0
    """Steady horizontal drift while a velocity is asked for, zero included, one sigma per axis [m/s]."""
    lift_off_velocity_m_s: Annotated[float, Field(ge=0, le=2)] = 0.0
    """Error of the estimated horizontal velocity at lift-off, one sigma per axis [m/s]: of a PX4. An ArduPilot has a
    twentieth of it."""
    one_partner: bool = False
    """true: it answers only its first sender, until it is started again, as PX4's UDP link does."""
    mavlink_1_until_greeted: bool = False
    """true: it speaks MAVLink 1 until it receives MAVLink 2, as PX4 with MAV_PROTO_VER 0 does."""
    gyro_bias_deg_s: Annotated[float, Field(ge=0, le=5)] = 0.05
    """Bias of the gyroscopes, one sigma [deg/s]."""
    battery: Annotated[tuple[Share, Share], AfterValidator(rising)] = (0.85, 1.0)
    """Charge at the start, 0 to 1."""
    battery_drain_per_min: Annotated[float, Field(ge=0, le=10)] = 0.05
    """Charge that a minute of flight costs, as a share of the full charge."""
    air_unrest_m_s2: Annotated[float, Field(ge=0, le=5)] = 0.08
    """Random acceleration of a hovering vehicle by the air of the room, one sigma [m/s^2]."""
