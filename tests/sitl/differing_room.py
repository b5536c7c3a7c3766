"""Runs the ground station in a room that differs from its field: `differing_room.py A.B=C ... -- sitl lab ...`."""

import sys
from typing import Any

from groundstation.cli.main import main
from groundstation.flight import composition
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field

as_described = composition._sim_bridge
SPLIT = sys.argv.index("--")
CHANGES, ARGUMENTS = tuple(sys.argv[1:SPLIT]), sys.argv[SPLIT + 1 :]


def _differing(field: Any, simulation: Any) -> Any:
    real = load_field(find_field(ARGUMENTS[1]), CHANGES)
    drones = {
        name: drone.model_copy(
            update={key: getattr(real.drones[name], key) for key in ("marker", "pad_m", "pad_yaw_deg")}
        )
        for name, drone in field.drones.items()
    }
    kept = {name: {"source": camera.source} for name, camera in field.cameras.items()}
    cameras = {name: camera.model_copy(update=kept[name]) for name, camera in real.cameras.items()}
    return as_described(field.model_copy(update={"drones": drones, "cameras": cameras}), simulation)


if __name__ == "__main__":
    composition._sim_bridge = _differing
    sys.argv[1:] = ARGUMENTS
    main()
