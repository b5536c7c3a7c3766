"""A target that is seen seldom, and was carried off: it is found however fast it moves."""

import pytest

from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement
from groundstation.estimation.models import ConstantVelocityTarget, FixedMount, MountedCamera
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters

MS, START = 1_000_000, 10_000_000_000_000
KNOWN, SEEN_S, HEIGHT_M = (4e-4, 0.0, 0.0, 0.0, 0.0, 4e-4, 0.0, 0.0, 0.0, 0.0, 4e-4, 0.0, 0.0, 0.0, 0.0, 1e-3), 4.0, 3.9


@pytest.mark.parametrize(("speed_m_s", "every_ms"), [(1.0, 1000), (1.2, 500), (2.0, 200)])
def test_a_target_that_was_carried_off_and_drives_on_is_found_by_rare_sightings(
    speed_m_s: float, every_ms: int
) -> None:
    rover, mount = ConstantVelocityTarget(marker_height_m=0.3), FixedMount((0.0, 0.0, 4.2), 0.004, 0.01)
    camera = MountedCamera("ceiling", WORLD_FROM_DOWN)
    belief = FixedLagFilter(EstimatorParameters({"rover": rover, "ceiling": mount}, {"ceiling": camera}))
    x, y, direction, joined_s = -1.0, 0.0, 1.0, []
    for step in range(1, 1000):
        now_s, now_ns = step * 0.01, START + step * 10 * MS
        if now_s == SEEN_S:
            y, direction = 4.0, -1.0
        x += direction * speed_m_s * 0.01
        if step * 10 % (100 if now_s < SEEN_S else every_ms) == 0:
            belief.add_observation(Measurement(now_ns, "ceiling", "rover", (x, -y, HEIGHT_M), 0.0, KNOWN), "a", now_ns)
        belief.advance(now_ns)
        joined_s += [now_s - SEEN_S for each in belief.take_corrections() if each.joined and now_s > SEEN_S]
    assert len(joined_s) == 1 and joined_s[0] <= 5.0 * every_ms / 1000
