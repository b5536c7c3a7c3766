"""The forecast agrees with the flight."""

import math

import numpy as np
import pytest

from groundstation.field.resolved import ResolvedField
from groundstation.forecast.floor import PlaceForecaster
from groundstation.forecast.team import team_of
from sim_bridge.scenario import Scenario
from sim_bridge.study.runner import Study, StudyOptions
from sim_bridge.world.ardrone import Quadrotor

_FOUND_S, _SECONDS, _EVERY, _FORECAST_EVERY = 3.0, 15.0, 20, 30


def test_the_filters_deviation_in_flight_is_within_thirty_percent_of_the_forecast(lab_field: ResolvedField) -> None:
    """Along the same positions. The error is smaller than both."""
    options = StudyOptions(seed=1, duration_s=_SECONDS)
    study, forecaster = Study(lab_field, Scenario(), options), PlaceForecaster(lab_field, team_of(lab_field))
    for drone in study.world.of(Quadrotor).values():
        drone.autopilot.take_off()
    flown: list[float] = []
    expected: list[float] = []
    while study.world.time_s < options.take_off_s + _SECONDS:
        study.step()
        if study.world.time_s < options.take_off_s + _FOUND_S or study.world.ticks % _EVERY:
            continue
        flown.append(np.trace(study.tracker.belief.covariance_of("turtlebot")[:2, :2]))
        if len(flown) % _FORECAST_EVERY == 1:
            truth = dict(zip(study.world.bodies, study.world.states(), strict=True))["turtlebot"]
            std = forecaster.at((float(truth[0]), float(truth[1]))).std_m
            assert std is not None
            expected.append(std**2)
    assert len(expected) >= 4
    assert math.sqrt(np.mean(flown) / np.mean(expected)) == pytest.approx(1.0, abs=0.3)
