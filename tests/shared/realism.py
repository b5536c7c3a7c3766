"""Minimum errors of the default scenario: those measured on real drones and cameras."""

from collections.abc import Callable

from sim_bridge.scenario import Scenario
from sim_bridge.target_paths import Anywhere, Path, Standstill

# A weaker value in the default scenario would make a simulated run optimistic.
_REALISTIC: tuple[tuple[str, Callable[[Scenario], bool]], ...] = (
    ("drones.navdata_hz: 200", lambda s: s.drones.navdata_hz == 200),
    (
        "drones.velocity_gain: reaching down to 0.80, at most 0.90",
        lambda s: _within(s.drones.velocity_gain, 0.80, 0.90),
    ),
    ("drones.velocity_delay_ms: from 20 up to 40", lambda s: _at_least(s.drones.velocity_delay_ms, 20, 40)),
    ("drones.velocity_noise_m_s: >= 0.03", lambda s: s.drones.velocity_noise_m_s >= 0.03),
    ("drones.height_noise_m: >= 0.034", lambda s: s.drones.height_noise_m >= 0.034),
    ("drones.height_delay_ms: >= 85", lambda s: s.drones.height_delay_ms >= 85),
    ("drones.attitude_noise_deg: >= 1", lambda s: s.drones.attitude_noise_deg >= 1),
    ("drones.attitude_correlation_s: >= 5", lambda s: s.drones.attitude_correlation_s >= 5),
    ("drones.yaw_wander_deg: >= 3", lambda s: s.drones.yaw_wander_deg >= 3),
    (
        "drones.yaw_jump_at_lift_off_deg: from 60 up to 143",
        lambda s: _at_least(s.drones.yaw_jump_at_lift_off_deg, 60, 143),
    ),
    ("drones.downwash: true", lambda s: s.drones.downwash),
    ("drones.ultrasound_crosstalk: true", lambda s: s.drones.ultrasound_crosstalk),
    ("drones.attitude_bias_deg: >= 0.8", lambda s: s.drones.attitude_bias_deg >= 0.8),
    ("cameras.fps: <= 15", lambda s: s.cameras.fps <= 15),
    ("cameras.video_delay_ms: >= 120", lambda s: s.cameras.video_delay_ms >= 120),
    ("cameras.video_jitter_ms: >= 20", lambda s: s.cameras.video_jitter_ms >= 20),
    ("cameras.mounting_errors: true", lambda s: s.cameras.mounting_errors),
    ("cameras.frame_loss: >= 0.05", lambda s: s.cameras.frame_loss >= 0.05),
    ("cameras.corner_noise_px: >= 0.2", lambda s: s.cameras.corner_noise_px >= 0.2),
    (
        "target.path: driven at >= 0.2 m/s",
        lambda s: all(_is_realistic_path(target.path) for target in (s.target, *s.targets.values())),
    ),
    ("target.slip: > 0", lambda s: all(target.slip > 0 for target in (s.target, *s.targets.values()))),
)


def _within(interval: tuple[float, float], low: float, high: float) -> bool:
    return interval[0] <= low and interval[1] <= high


def _at_least(interval: tuple[float, float], low: float, high: float) -> bool:
    return interval[0] >= low and interval[1] >= high


def _is_realistic_path(path: Path) -> bool:
    return not isinstance(path, Standstill | Anywhere) and path.speed_m_s >= 0.2


def weaker_than_reality(scenario: Scenario) -> list[str]:
    """Return the figures of a scenario that are better than those measured on real drones and cameras."""
    return [promise for promise, keeps in _REALISTIC if not keeps(scenario)]
