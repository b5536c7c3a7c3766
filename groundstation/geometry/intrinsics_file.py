"""A calibration file's content (config/cameras/*.yaml) to `CameraIntrinsics`."""

from collections.abc import Mapping
from typing import Any

from groundstation.geometry.lens import CameraIntrinsics

_SIZES = ("width_px", "height_px")
_FIGURES = ("fx_px", "fy_px", "cx_px", "cy_px")
MODEL = "plumb_bob"


def intrinsics_from_mapping(document: Mapping[str, Any]) -> CameraIntrinsics:
    """Return the intrinsics that a parsed calibration file holds; raises ValueError naming the first wrong entry."""
    model = document.get("model", MODEL)
    if model != MODEL:
        raise ValueError(f"model: only {MODEL} is known (got {model})")
    for name in (*_SIZES, *_FIGURES, "distortion"):
        if name not in document:
            raise ValueError(f"{name}: is missing")
    width, height = (int(document[name]) for name in _SIZES)
    fx, fy, cx, cy = (float(document[name]) for name in _FIGURES)
    k1, k2, p1, p2, k3 = (float(value) for value in document["distortion"])
    residual = float(document.get("residual_px", 0.2))
    return CameraIntrinsics(width, height, fx, fy, cx, cy, (k1, k2, p1, p2, k3), residual)
