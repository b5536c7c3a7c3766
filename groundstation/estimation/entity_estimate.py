"""The published estimate of one entity of the joint belief."""

from groundstation.bus.messages import NEVER_S, EntityEstimate
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.layout import EntityKind
from groundstation.estimation.velocity_spread import robot_velocity_covariance


def entity_estimate(
    joint: FixedLagFilter, belief: JointBelief, name: str, converged: bool, age_s: float, unlocalised_s: float
) -> EntityEstimate:
    """Return a robot's x, y, z, yaw or a target's x, y with covariance and velocity [m, rad, m/s; world]."""
    block = belief.layout.block(name)
    mean, covariance = belief.mean_of(name), belief.covariance_of(name)
    if block.kind is EntityKind.ROBOT:
        size = 4
        velocity: tuple[float, ...] = joint.velocity_of(name)
        spread = robot_velocity_covariance(joint, name, covariance)
    else:
        size = 2
        velocity = (float(mean[2]), float(mean[3]))
        spread = covariance[2:4, 2:4]
    return EntityEstimate(
        name=name,
        kind=str(block.kind),
        mean=tuple(mean[:size].tolist()),
        covariance=tuple(covariance[:size, :size].ravel().tolist()),
        velocity_m_s=velocity,
        converged=converged,
        age_s=min(age_s, NEVER_S),
        unlocalised_s=min(unlocalised_s, NEVER_S),
        contradicted=joint.contradicted(name),
        sighting=joint.sighting(name),
        velocity_covariance=None if spread is None else tuple(spread.ravel().tolist()),
    )
