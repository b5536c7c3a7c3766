"""The tracker's table of flight modes, evaluated for each robot on every tick."""

from dataclasses import dataclass
from enum import StrEnum


class FlightMode(StrEnum):
    """The rule that determines a robot's setpoint."""

    UNKNOWN = "UNKNOWN"  # not in the belief: hover until a camera sees it
    RETURN = "RETURN"  # badly localised, or unseen for too long: back to the middle of the world-fixed cameras' view
    SEARCH = "SEARCH"  # localised, but no target is: look around
    TRACK = "TRACK"  # obey the plan


@dataclass(frozen=True, slots=True)
class Situation:
    """The inputs of the table for one airborne robot.

    target_fresh: a target was seen within lost_after_s; planned: the plan holds controls for the robot.
    """

    in_belief: bool
    lost: bool = False
    target_fresh: bool = False
    planned: bool = False


def flight_mode_of(situation: Situation) -> FlightMode:
    """Return the mode: that of the first row that applies, from the most careful to the boldest."""
    if not situation.in_belief:
        return FlightMode.UNKNOWN
    if situation.lost:
        return FlightMode.RETURN
    if not (situation.target_fresh and situation.planned):
        return FlightMode.SEARCH
    return FlightMode.TRACK
