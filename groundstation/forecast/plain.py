"""A forecast as plain values, for JSON."""

from typing import Any

from groundstation.forecast.failures import Failure
from groundstation.forecast.floor import PlaceForecast, Spread, spread_of
from groundstation.forecast.forecast import Forecast
from groundstation.forecast.observability import Direction, Observability


def plain(forecast: Forecast) -> dict[str, Any]:
    """Return all figures; lengths in m, angles in rad, shares from 0 to 1; std_m: null where the target is not seen."""
    floor = forecast.floor
    return {
        "target": forecast.team.target,
        "floor": {
            "x_m": floor.xs.tolist(),
            "y_m": floor.ys.tolist(),
            "places": [[_place(one) for one in row] for row in floor.rows],
            **_spread(spread_of(floor.places)),
        },
        "blind": [
            {"share": one.share, "x_m": list(one.x_m), "y_m": list(one.y_m), "reason": one.reason}
            for one in floor.regions()
        ],
        "path": {"places": [_place(one) for one in forecast.path], **_spread(spread_of(forecast.path))}
        if forecast.path
        else None,
        "failures": {"nothing": _spread(forecast.base), **{one.what: _failure(one) for one in forecast.failures}},
        "observability": [_observability(one) for one in forecast.observability],
        "battery": {one.drone: one.seconds for one in forecast.endurance},
    }


def _place(one: PlaceForecast) -> dict[str, Any]:
    stand = None
    if one.stand is not None:
        poses = {name: [round(v, 3) for v in pose.tolist()] for name, pose in one.stand.poses.items()}
        stand = {"topology": str(one.stand.topology), "poses": poses, "left_by_planner": one.stand.is_left}
    return {"place_m": list(one.place), "std_m": one.std_m, "reason": one.reason, "stand": stand}


def _spread(spread: Spread) -> dict[str, Any]:
    return {"median_m": spread.median_m, "worst_m": spread.worst_m, "blind_share": spread.blind}


def _failure(one: Failure) -> dict[str, Any]:
    return {**_spread(one.without), "unlocalised": list(one.unlocalised)}


def _observability(one: Observability) -> dict[str, Any]:
    return {
        "topology": str(one.topology),
        "rank": one.rank,
        "missing": list(one.missing),
        "worst_place": _direction(one.worst_m),
        "worst_heading": _direction(one.worst_yaw),
        "entries": {entry.name: {"before": entry.before, "after": entry.after} for entry in one.entries},
    }


def _direction(one: Direction | None) -> dict[str, Any] | None:
    return None if one is None else {"std": one.std, "parts": dict(one.parts)}
