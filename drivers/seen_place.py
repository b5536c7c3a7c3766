"""The time at which a vehicle was where an estimate has it, when its motion since then is unknown. Pure."""

from groundstation.bus.messages import EntityEstimate
from groundstation.time_units import NS_PER_S

# The greatest age at ten pictures a second that are 0.17 s late, with one of them lost.
_OLDEST_S = 0.4
# Two places known to 0.1 m give a speed to 0.28 m/s, and the first sighting after a while moves the belief by as much.
MOST_STD_M = 0.05


def last_seen(now_ns: int, entity: EntityEstimate) -> tuple[int, float] | None:
    """Return when the vehicle was last seen [ns], and the deviation of its place then [m].

    None if that is long ago, or the place was not known to 5 cm. The belief of a vehicle that reports no motion stays
    where it was seen, and widens to 0.15 m until the next picture arrives.
    """
    if entity.sighting is None:
        return None
    age_s, std_m = entity.sighting
    return (now_ns - round(age_s * NS_PER_S), std_m) if age_s <= _OLDEST_S and std_m <= MOST_STD_M else None
