"""Heights with which the search begins, where the field file leaves them to its room and its targets."""

FENCE_MARGIN_M, OVER_TARGET_M = 0.3, 0.4
"""Least distances [m] from the top of the fence and from the highest target's marker."""
LEAST_BAND_M = 0.2
"""Least height [m] of the band in between."""
_COMFORTABLY_OVER_TARGET_M, _LOWEST_M = 0.7, 0.8
# Height of the band, in planned ranges: from its top, cameras still see far enough across the floor.
_BAND_IN_RANGES = 0.75
_BETWEEN_LEVELS_M = 0.4

LevelRows = tuple[tuple[float, ...], ...]


def derived_heights(fence_top_m: float, target_m: float, range_m: float, team: int) -> LevelRows:
    """Return a row for each number of levels that the band has room for, at most one per drone [m].

    target_m: height of the highest target's marker; range_m: planned range. The band lies low over the target in a
    room of any height, for cameras have a range.
    """
    highest = fence_top_m - FENCE_MARGIN_M
    comfortable = max(target_m + _COMFORTABLY_OVER_TARGET_M, _LOWEST_M)
    low = max(target_m + OVER_TARGET_M, min(comfortable, highest - LEAST_BAND_M))
    high = max(low, min(highest, low + _BAND_IN_RANGES * range_m))
    levels = max(1, min(team, 1 + int((high - low) / _BETWEEN_LEVELS_M)))
    return tuple(_row(low, high, number) for number in range(1, levels + 1))


def _row(low: float, high: float, levels: int) -> tuple[float, ...]:
    """Return the heights of a number of levels, top level first; one or two stay low, near to the target."""
    if levels == 1:
        return (round(low + (high - low) / 3, 2),)
    if levels == 2:
        return round(low + max(0.5 * (high - low), _BETWEEN_LEVELS_M), 2), round(low, 2)
    return tuple(round(high - (high - low) * level / (levels - 1), 2) for level in range(levels))
