"""Runs the ground station with drone_1 and drone_2 on each other's pads, with each other's markers.

For the ground station this equals a field file with the two addresses exchanged.
"""

from typing import Any

from groundstation.cli.main import main
from groundstation.flight import composition

as_described = composition._sim_bridge
CARRIED = ("marker", "pad_m", "pad_yaw_deg")


def _exchanged(field: Any, simulation: Any) -> Any:
    one, two = field.drones["drone_1"], field.drones["drone_2"]
    drones = {
        "drone_1": one.model_copy(update={key: getattr(two, key) for key in CARRIED}),
        "drone_2": two.model_copy(update={key: getattr(one, key) for key in CARRIED}),
    }
    return as_described(field.model_copy(update={"drones": field.drones | drones}), simulation)


if __name__ == "__main__":
    composition._sim_bridge = _exchanged
    main()
