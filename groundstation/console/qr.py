"""QR codes for the terminal."""

import cv2
import numpy as np

# A reader wants four light modules around a code; OpenCV draws two.
_MORE_QUIET = 2
_GLYPHS = {(True, True): "\u2588", (True, False): "\u2580", (False, True): "\u2584", (False, False): " "}


def qr_text(text: str) -> str:
    """Return a code for a dark or light terminal: two modules per character, drawn light on dark by escape codes."""
    parameters = cv2.QRCodeEncoder.Params()
    parameters.mode = cv2.QRCodeEncoder_MODE_BYTE
    modules = cv2.QRCodeEncoder.create(parameters).encode(text)
    below = _MORE_QUIET + len(modules) % 2
    light = np.pad(modules > 0, ((_MORE_QUIET, below), (_MORE_QUIET, _MORE_QUIET)), constant_values=True).tolist()
    pairs = zip(light[::2], light[1::2], strict=True)
    lines = ("".join(map(_GLYPHS.__getitem__, zip(*pair, strict=True))) for pair in pairs)
    return "\n".join(f"\x1b[97;40m{line}\x1b[0m" for line in lines)
