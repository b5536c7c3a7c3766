"""A target's odometry without a wire: its wheels in, reports as its driver publishes them out."""

from groundstation.bus.messages import Header, ReportedMotion
from groundstation.field.targets import odometry_name
from sim_bridge.mounting import generator_of_eye
from sim_bridge.site import Site, SiteOdometry
from sim_bridge.wheel_odometry import PERIOD_S, WheelOdometry
from sim_bridge.world.world import World


class OdometryEar:
    """The reports of one target."""

    period_s = PERIOD_S

    def __init__(self, target: str, odometry: SiteOdometry, world: World, errors: bool, seed: int) -> None:
        self.name, self.lateness_ms = odometry_name(target), odometry.delay_ms
        self._target, self._std_m_s, self._seq = target, odometry.speed_std_m_s, 0
        self._wheels = WheelOdometry(world.targets[target], errors, generator_of_eye(seed, self.name))

    def look(self, world: World, stamp_ns: int, clock: str) -> list[ReportedMotion]:
        """Return the target's present report."""
        self._seq += 1
        speed, _ = self._wheels.read()
        header = Header(stamp_ns, clock, self._target, self.name, self._seq)
        return [ReportedMotion(header=header, velocity_m_s=(speed, 0.0), std_m_s=self._std_m_s)]


def odometry_of(site: Site, world: World, errors: bool, seed: int) -> list[OdometryEar]:
    """Return the models of those targets of a site that report their odometry."""
    told = {name: target.odometry for name, target in site.tracked.items()}
    return [OdometryEar(name, one, world, errors, seed) for name, one in told.items() if one is not None]
