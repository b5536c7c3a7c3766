"""A search by the lab's two drones: beliefs, pictures and sightings for it."""

from pathlib import Path

import numpy as np

from groundstation.bus.messages import Header, RelativeObservation, SearchedPicture
from groundstation.control.excursion import Excursions
from groundstation.control.parameters import ControlParameters, control_from_field
from groundstation.control.search_parameters import SearchParameters, search_from_field
from groundstation.control.target_search import Search
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.models import SensorSuite
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

CONFIG = Path(__file__).parents[2] / "config"
LAB = resolved_field(load_field(CONFIG / "lab.yaml"))
SENSORS, CONTROL, SEARCH = sensors_from_field(LAB), control_from_field(LAB), search_from_field(LAB)
NAMES = ("drone_1", "drone_2")


def belief(poses: dict[str, np.ndarray], stamp_s: float, target: tuple[float, float] | None = None) -> JointBelief:
    layout, mean, variances = StateLayout(), [], []
    for name, pose in poses.items():
        layout = layout.with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
        mean += pose.tolist()
        variances += [0.03**2] * 4
    if target is not None:
        layout = layout.with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
        mean += [*target, 0.0, 0.0]
        variances += [0.1**2] * 4
    return JointBelief(np.array(mean), np.diag(variances), layout, round(stamp_s * 1e9))


def picture(observer: str, stamp_s: float, *found: str) -> SearchedPicture:
    header = Header(round(stamp_s * 1e9), "c", observer, observer, round(stamp_s * 100))
    return SearchedPicture(header=header, observer=observer, camera=f"{observer}_camera", found=found)


def sighting(observer: str, stamp_s: float) -> RelativeObservation:
    header = Header(round(stamp_s * 1e9), "c", observer, observer, round(stamp_s * 100))
    return RelativeObservation(
        header=header, observer=observer, subject="turtlebot", camera=f"{observer}_camera", position_m=(0.0, 0.0, 1.0),
        yaw_rad=0.0, covariance=tuple((1e-4 * np.eye(4)).ravel().tolist()), margin=2.0, roll_rad=0.0, pitch_rad=0.0,
    )  # fmt: skip


def new_search(
    parameters: SearchParameters = SEARCH, sensors: SensorSuite = SENSORS, control: ControlParameters = CONTROL
) -> Search:
    return Search(parameters, control, sensors, ("turtlebot",), Excursions(control, sensors))
