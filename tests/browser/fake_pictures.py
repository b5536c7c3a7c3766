"""Pictures of a floor with one checkerboard, where a camera would see it, or with none."""

import cv2
import numpy as np

Point = tuple[float, float, float]


def paint(size: tuple[int, int], focal: float, at: Point | None) -> bytes:
    """Return the JPEG of a picture (width, height) with a board at a point [camera_optical]; None: without one."""
    width, height = size
    picture = np.full((height, width, 3), 96, np.uint8)
    picture[::40, :] = picture[:, ::40] = 120
    if at is not None:
        _paint_board(picture, focal, at)
    ok, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 80])
    assert ok
    return bytes(jpeg)


def _paint_board(picture: np.ndarray, focal: float, at: Point) -> None:
    height, width = picture.shape[:2]
    u, v, r = width / 2 + focal * at[0] / at[2], height / 2 + focal * at[1] / at[2], focal * 0.11 / at[2]
    cv2.rectangle(picture, (int(u - r), int(v - r)), (int(u + r), int(v + r)), (245, 245, 245), -1)
    step = 2 * r / 5
    for i in range(5):
        for j in range(4):
            if (i + j) % 2 == 0:
                a = (int(u - r + i * step), int(v - r + j * step))
                cv2.rectangle(picture, a, (int(a[0] + step), int(a[1] + step)), (20, 20, 20), -1)
