"""Undistorting and distorting a pixel again returns the pixel, for any calibration."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.geometry.lens import CameraIntrinsics

_small = st.floats(-0.005, 0.005)


@settings(max_examples=60, deadline=None)
@given(
    k1=st.floats(-0.55, 0.3),
    k2=st.floats(-0.05, 0.3),
    p1=_small,
    p2=_small,
    k3=st.floats(-0.02, 0.1),
    u=st.floats(0.0, 639.0),
    v=st.floats(0.0, 359.0),
)
def test_round_trip(k1, k2, p1, p2, k3, u, v):
    lens = CameraIntrinsics(640, 360, 460.0, 470.0, 319.5, 179.5, (k1, k2, p1, p2, k3))
    pixel = np.array([[u, v]])
    ray = lens.normalised_from_pixels(pixel)
    if np.isfinite(ray).all():
        assert np.abs(lens.pixels_from_normalised(ray) - pixel).max() < 1e-5
    else:
        # Only pixels outside of the model's range, far from the centre, may have no ray.
        assert np.hypot(u - 319.5, v - 179.5) > 0.5 * 460.0
