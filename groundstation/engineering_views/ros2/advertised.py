"""Topics of a field's flight, to be advertised before their first messages."""

from collections.abc import Mapping

from groundstation.engineering_views.ros2.health import BATTERY, DIAGNOSTICS, LOG
from groundstation.engineering_views.ros2.markers import MARKERS
from groundstation.engineering_views.ros2.names import own
from groundstation.engineering_views.ros2.pictures import LENS, PICTURE
from groundstation.engineering_views.ros2.stencils import FRAMES, ODOMETRY, POSE, SURE_POSE, TWIST
from groundstation.field.resolved import ResolvedField


def advertised(field: ResolvedField | None, truth: bool) -> Mapping[str, str]:
    """Return the type of each topic by its name; field None: topics of every field; truth: with true states."""
    found = {
        "/tf": FRAMES.type,
        "/tf_static": FRAMES.type,
        own("markers"): MARKERS,
        "/diagnostics": DIAGNOSTICS,
        "/rosout": LOG,
    }
    if field is None:
        return found
    for name in (*field.drones, *field.tracked):
        found |= {own(f"{name}/pose"): SURE_POSE.type, own(f"{name}/odom"): ODOMETRY.type}
        found |= {own(f"{name}/truth"): POSE.type} if truth else {}
    for name in field.drones:
        found |= {own(f"{name}/setpoint"): TWIST.type, own(f"{name}/battery"): BATTERY}
    for name in field.calibrations:
        found |= {own(f"{name}/image/compressed"): PICTURE, own(f"{name}/camera_info"): LENS}
    return found
