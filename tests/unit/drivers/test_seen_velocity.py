"""A vehicle's velocity from the positions at which cameras observed it."""

import math
from typing import Any

import pytest

from drivers.seen_velocity import SeenVelocity
from groundstation.bus.messages import EntityEstimate

S = 1_000_000_000
MS = 1_000_000


def seen_velocity(positions, yaw=0.0, yaw_rate=0.0, **fields):
    seen, velocities = SeenVelocity(), []
    for turn, (x, y) in enumerate(positions):
        heading = yaw + yaw_rate * turn / 50
        values: dict[str, Any] = {"converged": True, "age_s": 0.1, "covariance": (1e-4,) * 16} | fields
        entity = EntityEstimate(
            name="v", kind="robot", mean=(x, y, 0.8, heading), velocity_m_s=(0.0, 0.0, 0.0), **values
        )
        seen.take(turn * S // 50, 1, entity)
        velocities.append(seen.velocity(turn * S // 50))
    return velocities


def test_positions_seen_become_a_velocity_in_the_vehicles_frame():
    moving = [(0.5 * i / 50, 0.0) for i in range(100)]
    assert seen_velocity(moving)[10] is None
    assert seen_velocity(moving, yaw=math.pi / 2)[-1] == pytest.approx((0.0, -0.5), abs=1e-9)


def test_a_velocity_seen_while_turning_is_the_mean_one_of_the_vehicles_frame():
    velocity = seen_velocity([(0.5 * i / 50, 0.0) for i in range(50)], yaw_rate=1.0)[-1]
    window = [i / 50 for i in range(19, 50)]  # headings of the last 0.6 s
    mean = [0.5 * sum(map(f, window)) / len(window) for f in (math.cos, lambda yaw: -math.sin(yaw))]
    assert velocity == pytest.approx(mean, abs=0.01)


@pytest.mark.parametrize("fields", [{"converged": False}, {"age_s": 2.0}, {"covariance": (0.06**2,) * 16}])
def test_nothing_is_made_of_positions_that_nobody_sees_well(fields):
    assert seen_velocity([(0.5 * i / 50, 0.0) for i in range(100)], **fields)[-1] is None


WIDE: dict[str, Any] = {"covariance": (0.15**2,) * 16}  # it has no motion telemetry, and pictures are 0.15 s late


def test_a_silent_vehicle_is_seen_where_its_last_picture_showed_it():
    moving = [(0.5 * i / 50, 0.0) for i in range(100)]
    assert seen_velocity(moving, sighting=(0.2, 0.015), **WIDE)[-1] == pytest.approx((0.5, 0.0), abs=1e-9)


def test_a_silent_vehicle_is_timed_by_its_pictures():
    """Ten of them a second, each 0.15 s late: in between its belief stands still."""
    seen = SeenVelocity()
    for turn in range(100):
        late = turn % 5
        place = 1.0 * (turn - late) / 50
        entity = EntityEstimate(
            name="v", kind="robot", mean=(place, 0.0, 0.8, 0.0), velocity_m_s=(0.0, 0.0, 0.0), converged=True,
            age_s=0.15 + late / 50, sighting=(0.15 + late / 50, 0.015), **WIDE
        )  # fmt: skip
        seen.take(turn * S // 50, 1, entity)
        if turn > 40:
            assert seen.velocity(turn * S // 50) == pytest.approx((1.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("sighting", [None, (0.5, 0.015), (0.2, 0.06)])
def test_a_silent_vehicle_is_not_seen_by_an_old_or_a_poor_picture(sighting):
    assert seen_velocity([(0.0, 0.0)] * 100, sighting=sighting, **WIDE)[-1] is None


def test_a_belief_that_was_set_anew_is_no_flight():
    velocities = seen_velocity([(0.0, 0.0)] * 50 + [(1.0, 0.0)] * 50)
    assert max(abs(v[0]) for v in velocities if v is not None) < 1e-9


# -- limits: to the nanosecond, and to the last bit where it can be ---------------------------------------------------

KNOWN: dict[str, Any] = {"converged": True, "age_s": 0.1, "covariance": (1e-4,) * 16}


def seen_at(*places: tuple[int, float], epoch: int = 1, seen: SeenVelocity | None = None, **fields: Any):
    """Return observations of a vehicle at (time [ns], x [m])."""
    seen = seen or SeenVelocity()
    for at_ns, x in places:
        values = KNOWN | fields
        mean, standing = (x, 1.0, 0.8, 0.0), (0.0, 0.0, 0.0)
        seen.take(S + at_ns, epoch, EntityEstimate(name="v", kind="robot", mean=mean, velocity_m_s=standing, **values))
    return seen


def forward(seen: SeenVelocity, at_ns: int) -> float | None:
    velocity = seen.velocity(S + at_ns)
    return None if velocity is None else velocity[0]


def test_a_velocity_takes_a_little_less_than_half_a_second() -> None:
    assert forward(seen_at((0, 0.0), (450 * MS - 1, 0.45)), 450 * MS) is None
    assert forward(seen_at((0, 0.0), (450 * MS, 0.45)), 450 * MS) == pytest.approx(1.0)


def test_it_is_of_the_last_six_tenths_of_a_second() -> None:
    assert forward(seen_at((0, 0.0), (100 * MS, 0.3), (600 * MS, 0.6)), 600 * MS) == pytest.approx(1.0)
    assert forward(seen_at((0, 0.0), (100 * MS, 0.3), (600 * MS + 1, 0.6)), 601 * MS) == pytest.approx(0.6)


def test_it_is_forgotten_three_tenths_of_a_second_after_the_last_word() -> None:
    seen = seen_at((0, 0.0), (500 * MS, 0.5))
    assert forward(seen, 800 * MS) == pytest.approx(1.0)
    assert forward(seen, 800 * MS + 1) is None


def test_the_same_picture_again_is_a_word_and_no_place() -> None:
    seen = seen_at((0, 0.0), (500 * MS, 0.5))
    seen_at((700 * MS, 0.6), seen=seen, covariance=(1.0,) * 16, sighting=(0.2, 0.02))
    assert forward(seen, 1000 * MS) == pytest.approx(1.0)


def test_as_far_as_it_can_have_flown_is_a_flight_and_farther_is_none() -> None:
    begun = (0, 0.0), (480 * MS, 0.0)
    assert forward(seen_at(*begun, (500 * MS, 0.18)), 500 * MS) == pytest.approx(0.36)
    assert forward(seen_at(*begun, (500 * MS, 0.181)), 500 * MS) is None


@pytest.mark.parametrize(
    ("fields", "known"),
    [
        ({"age_s": 0.5}, True),
        ({"age_s": 0.501}, False),
        ({"covariance": (0.05**2,) * 16}, True),
        ({"covariance": (0.06**2, *(1e-4,) * 15)}, False),
        ({"covariance": (*(1e-4,) * 5, 0.06**2, *(1e-4,) * 10)}, False),
        ({"covariance": (1e-4,) * 4}, False),
    ],
)
def test_a_place_counts_that_was_corrected_lately_and_is_known_well_either_way(fields, known) -> None:
    assert (forward(seen_at((0, 0.0), (500 * MS, 0.5), **fields), 500 * MS) is not None) is known


@pytest.mark.parametrize("between", [{"epoch": 2}, {"converged": False}, {"age_s": 1.0}])
def test_nothing_is_told_across_another_belief_or_a_moment_in_which_it_was_not_seen(between) -> None:
    seen = seen_at((0, 0.0))
    seen_at((100 * MS, 0.1), seen=seen, **between)
    epoch = between.get("epoch", 1)
    assert forward(seen_at((500 * MS, 0.5), seen=seen, epoch=epoch), 500 * MS) is None
    assert forward(seen_at((600 * MS, 0.8), seen=seen, epoch=epoch), 600 * MS) == (
        pytest.approx(1.4) if "epoch" in between else None
    )


def test_forward_and_left_are_those_of_the_middle_of_the_window() -> None:
    seen = SeenVelocity()
    for at_ns, yaw in ((0, 0.0), (200 * MS, 0.1), (400 * MS, math.pi / 2), (500 * MS, 3.0), (600 * MS, 2.0)):
        place = (0.3 * at_ns / S, 1.0 + 0.4 * at_ns / S, 0.8, yaw)
        one = EntityEstimate(name="v", kind="robot", mean=place, velocity_m_s=(0.0, 0.0, 0.0), **KNOWN)
        seen.take(S + at_ns, 1, one)
    assert seen.velocity(S + 600 * MS) == pytest.approx((0.4, -0.3))


# -- climb ------------------------------------------------------------------------------------------------------------


def climbing(*heights: tuple[int, float], **fields: Any) -> SeenVelocity:
    """Return observations of a vehicle at (time [ns], height [m])."""
    seen = SeenVelocity()
    for at_ns, z in heights:
        mean = (0.0, 0.0, z, 0.0)
        seen.take(
            S + at_ns,
            1,
            EntityEstimate(name="v", kind="robot", mean=mean, velocity_m_s=(0.0, 0.0, 0.0), **KNOWN | fields),
        )
    return seen


def test_heights_seen_become_a_climb() -> None:
    assert climbing((0, 1.0), (450 * MS - 1, 1.2)).climb(S + 450 * MS) is None
    assert climbing((0, 1.0), (450 * MS, 1.9)).climb(S + 450 * MS) == pytest.approx(2.0)
    assert climbing((0, 1.0), (100 * MS, 1.0), (500 * MS, 0.8)).climb(S + 800 * MS) == pytest.approx(-0.4)
    assert climbing((0, 1.0), (500 * MS, 0.8)).climb(S + 800 * MS + 1) is None


def test_a_height_that_was_set_anew_is_no_climb() -> None:
    assert climbing((0, 1.0), (480 * MS, 1.0), (500 * MS, 1.181)).climb(S + 500 * MS) is None
    assert climbing((0, 1.0), (480 * MS, 1.0), (500 * MS, 1.18)).climb(S + 500 * MS) == pytest.approx(0.36)


def test_a_height_that_is_known_poorly_tells_no_climb_though_the_place_tells_a_velocity() -> None:
    unsure = (*(1e-4,) * 10, 0.06**2, *(1e-4,) * 5)
    seen = climbing((0, 1.0), (500 * MS, 1.2), covariance=unsure)
    assert seen.climb(S + 500 * MS) is None and seen.velocity(S + 500 * MS) is not None
