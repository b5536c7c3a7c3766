"""Focus and exposure of a picture, independent of its content."""

import cv2
import numpy as np
import pytest

from drivers.camera.picture_quality import quality_of
from groundstation.arrays import Array, Image


def board(blur_px: float = 0.0, low: int = 40, high: int = 220) -> Image:
    """A checkerboard of 24 px squares with noise, blurred."""
    rows, columns = np.indices((360, 640)) // 24
    picture: Array = np.where((rows + columns) % 2, high, low).astype(np.float64)
    if blur_px:
        picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), blur_px))
    noise = np.random.default_rng(1).normal(0.0, 2.0, picture.shape)
    return np.clip(picture + noise, 0, 255).astype(np.uint8)


def test_edges_widen_with_blur() -> None:
    widths = [quality_of(board(blur_px)).edge_px or 0.0 for blur_px in (0.8, 2.0, 3.0)]
    assert 1.5 < widths[0] < 3.5 and 4.0 < widths[1] < 7.0 and 6.5 < widths[2] < 10.0


@pytest.mark.parametrize("low", [10, 40, 120])
def test_contrast_does_not_change_the_width(low: int) -> None:
    assert quality_of(board(2.0, low)).edge_px == pytest.approx(quality_of(board(2.0)).edge_px, rel=0.1)


def test_a_picture_without_contrast_is_not_called_blurred() -> None:
    quality = quality_of(board(0.0, 118, 122))
    assert quality.edge_px is None and quality.brightness == pytest.approx(120 / 255, abs=0.01)


def test_light_that_fades_is_no_blurred_edge() -> None:
    """A standing drone's camera has the floor before its lens, brighter towards the wall."""
    fading = np.tile(np.linspace(60.0, 190.0, 640), (360, 1))
    noise = np.random.default_rng(1).normal(0.0, 2.0, fading.shape)
    assert quality_of(np.clip(fading + noise, 0, 255).astype(np.uint8)).edge_px is None
