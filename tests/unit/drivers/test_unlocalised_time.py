"""For how long a driver takes its vehicle to have been elsewhere than estimated."""

from drivers.unlocalised_time import UnlocalisedTime
from groundstation.bus.messages import NEVER_S, EntityEstimate
from groundstation.time_units import NS_PER_S


def estimate(unlocalised_s: float) -> EntityEstimate:
    return EntityEstimate("drone_1", "robot", (0.0,) * 4, (0.0,) * 16, (0.0,) * 3, False, 0.1, unlocalised_s)


def test_time_grows_while_no_estimate_arrives_and_ends_on_the_ground() -> None:
    unlocalised = UnlocalisedTime()
    assert unlocalised.of_flight(0, True) == 0.0
    unlocalised.hear(NS_PER_S, estimate(3.0))
    assert unlocalised.of_flight(2 * NS_PER_S, True) == 4.0
    assert unlocalised.of_flight(3 * NS_PER_S, False) == unlocalised.of_flight(4 * NS_PER_S, True) == 0.0


def test_a_drone_that_was_never_localised_is_unlocalised_since_its_lift_off() -> None:
    """Its first estimate, by one round of ranges, is not sure enough to fly on: it must not land for that."""
    unlocalised = UnlocalisedTime()
    unlocalised.of_flight(5 * NS_PER_S, True)
    unlocalised.hear(7 * NS_PER_S, estimate(NEVER_S))
    assert unlocalised.of_flight(8 * NS_PER_S, True) == 3.0
