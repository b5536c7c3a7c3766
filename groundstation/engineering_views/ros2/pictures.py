"""Pictures of the cameras and their lenses, in the form of ROS 2 tools."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from groundstation.engineering_views.ros2.codec import Ros2Codec, RosMessage
from groundstation.engineering_views.ros2.geometry import Builder
from groundstation.engineering_views.ros2.names import own
from groundstation.field.room import LensCalibration

PICTURE, LENS = "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/CameraInfo"


class PictureMaker:
    """Makes a message of each picture; lenses: the known ones, by camera."""

    def __init__(self, codec: Ros2Codec, lenses: Mapping[str, LensCalibration]) -> None:
        self._codec, self._build = codec, Builder(codec)
        self._lenses = {camera: self._lens(lens) for camera, lens in lenses.items()}

    def picture(self, stamp_ns: int, camera: str, jpeg: bytes) -> list[RosMessage]:
        """Return a picture, and its lens if it is known."""
        header = self._build.header(stamp_ns, camera)
        data = np.frombuffer(jpeg, np.uint8)
        name = own(f"{camera}/image/compressed")
        found = [self._codec.message(name, PICTURE, header=header, format="jpeg", data=data)]
        lens = self._lenses.get(camera)
        if lens is not None:
            found.append(self._codec.message(own(f"{camera}/camera_info"), LENS, header=header, **lens))
        return found

    def _lens(self, lens: LensCalibration) -> dict[str, Any]:
        fx, fy, cx, cy = lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px
        whole = self._codec.make(
            "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        return {
            "height": lens.height_px,
            "width": lens.width_px,
            "distortion_model": "plumb_bob",
            "d": np.array(lens.distortion, dtype=np.float64),
            "k": np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1], dtype=np.float64),
            "r": np.eye(3).reshape(9),
            "p": np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0], dtype=np.float64),
            "binning_x": 0,
            "binning_y": 0,
            "roi": whole,
        }
