"""A camera can read the QR code in the terminal."""

import cv2
import numpy as np
import pytest

from groundstation.console.qr import qr_text

LIGHT = {"\u2588": (255, 255), "\u2580": (255, 0), "\u2584": (0, 255), " ": (0, 0)}


def shown(text: str) -> np.ndarray:
    """Return the modules in the terminal's output, 255 for light."""
    lines = [line.removeprefix("\x1b[97;40m").removesuffix("\x1b[0m") for line in qr_text(text).splitlines()]
    halves = [[[LIGHT[glyph][half] for glyph in line] for half in (0, 1)] for line in lines]
    return np.array(halves, np.uint8).reshape(2 * len(lines), -1)


@pytest.mark.parametrize("length", [1, 17, 18, 32, 33, 53, 54, 78, 79, 106, 107, 200])
def test_a_camera_reads_texts_of_every_length(length: int) -> None:
    text = "".join(chr(33 + n * 7 % 90) for n in range(length))
    picture = np.kron(shown(text), np.ones((6, 6), np.uint8))
    assert cv2.QRCodeDetector().detectAndDecode(picture)[0] == text


def test_the_code_has_its_quiet_zone() -> None:
    modules = shown("x")
    assert modules.shape == (21 + 9, 21 + 8)
    dark = np.argwhere(modules == 0)
    assert (dark.min(axis=0).tolist(), dark.max(axis=0).tolist()) == ([4, 4], [24, 24])
