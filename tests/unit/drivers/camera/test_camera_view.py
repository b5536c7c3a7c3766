"""`groundstation camera view`: lines and pictures of the detections, and a stream for a browser."""

import json
import socket
import threading
import urllib.request

import cv2
import numpy as np
import pytest

from drivers.camera.calibration.stream import PictureServer
from drivers.camera.multipart import MultipartParser
from groundstation.cli.main import run
from groundstation.geometry.board import EXTENT, raster

WIDTH, HEIGHT, FOCAL = 640, 360, 460.0
CALIBRATION = {
    "model": "plumb_bob", "width_px": WIDTH, "height_px": HEIGHT, "fx_px": FOCAL, "fy_px": FOCAL, "cx_px": 319.5,
    "cy_px": 179.5, "distortion": [0.0, 0.0, 0.0, 0.0, 0.0],
}  # fmt: skip


def picture(code=3, px_per_square=18):
    """Return a marker that faces the camera in the middle of the picture."""
    card, _ = raster(code, px_per_square)
    grey = np.full((HEIGHT, WIDTH), 110, np.uint8)
    # The board's centre, not the card's, in the principal point.
    left = round(WIDTH / 2 + EXTENT[0] * px_per_square)
    top = (HEIGHT - card.shape[0]) // 2
    grey[top : top + card.shape[0], left : left + card.shape[1]] = card
    return cv2.GaussianBlur(grey, (0, 0), 0.6)


@pytest.fixture
def files(tmp_path):
    (tmp_path / "in").mkdir()
    for number in range(3):
        cv2.imwrite(str(tmp_path / "in" / f"p{number}.png"), picture())
    (tmp_path / "lens.yaml").write_text(json.dumps(CALIBRATION))
    return tmp_path


def test_pictures_are_annotated_and_told(files, capsys):
    source, lens, out = (str(files / name) for name in ("in", "lens.yaml", "out"))
    assert run(["camera", "view", source, "--calibration", lens, "-o", out, "--frames", "2"]) == 0
    said = capsys.readouterr().out
    # 460 px x 44 mm / 18 px
    assert "p0.png: marker 3 at 1.12 m" in said and "markers in 2 of them" in said
    drawn = cv2.imread(str(files / "out" / "p1.jpg"))
    assert drawn is not None
    assert sorted(path.name for path in (files / "out").iterdir()) == ["p0.jpg", "p1.jpg"]
    plain = cv2.cvtColor(picture(), cv2.COLOR_GRAY2BGR)
    assert (np.abs(drawn.astype(int) - plain).max(axis=2) > 80).sum() > 200


def test_without_a_calibration_nothing_is_said_of_distances(files, capsys):
    assert run(["camera", "view", str(files / "in"), "--frames", "1"]) == 0
    assert "marker 3 somewhere" in capsys.readouterr().out


def tag_picture(number=7, side_px=72):
    """Return a tag of 168 mm that faces the camera in the middle of the picture, 1.07 m away."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36H11)
    grey = np.full((HEIGHT, WIDTH), 200, np.uint8)
    left, top = round((WIDTH - side_px) / 2), (HEIGHT - side_px) // 2
    grey[top : top + side_px, left : left + side_px] = cv2.aruco.generateImageMarker(dictionary, number, side_px)
    noise = np.random.default_rng(1).normal(0.0, 1.0, grey.shape)
    return np.clip(cv2.GaussianBlur(grey, (0, 0), 0.6) + noise, 0, 255).astype(np.uint8)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ((), "nothing found"),
        (("--dictionary", "DICT_APRILTAG_36H11"), "tag DICT_APRILTAG_36H11 7 at 1.0"),
        (("--dictionary", "DICT_APRILTAG_36H11", "--size-mm", "84"), "tag DICT_APRILTAG_36H11 7 at 0.5"),
    ],
)
def test_tags_are_shown_by_their_dictionary(files, capsys, options, told):
    for number in range(3):
        cv2.imwrite(str(files / "in" / f"p{number}.png"), tag_picture())
    lens = str(files / "lens.yaml")
    assert run(["camera", "view", str(files / "in"), "--calibration", lens, "--frames", "1", *options]) == 0
    assert told in capsys.readouterr().out


def test_every_picture_of_a_folder_is_searched(files, capsys):
    """Photographs that have nothing to do with each other: the next marker is elsewhere, or not there at all."""
    plain = np.full((HEIGHT, WIDTH), 110, np.uint8)
    pictures = [picture(3), plain, np.roll(picture(5), 150, axis=1), tag_picture(), np.roll(picture(9), -150, axis=1)]
    for number, shown in enumerate(pictures):
        cv2.imwrite(str(files / "in" / f"p{number}.png"), shown)
    assert run(["camera", "view", str(files / "in"), "--dictionary", "DICT_APRILTAG_36H11"]) == 0
    lines = capsys.readouterr().out.splitlines()
    told = ["marker 3 ", "nothing found", "marker 5 ", "tag DICT_APRILTAG_36H11 7 ", "marker 9 "]
    assert [word in line for word, line in zip(told, lines, strict=False)] == [True] * 5, lines


def test_a_mirrored_picture_is_told(files, capsys):
    for number in range(3):
        cv2.imwrite(str(files / "in" / f"p{number}.png"), picture()[:, ::-1])
    assert run(["camera", "view", str(files / "in"), "--frames", "1"]) == 0
    assert "1 mirrored: the camera's flip, or the print?" in capsys.readouterr().out


def test_bad_input_is_named(files, capsys):
    (files / "lens.yaml").write_text(json.dumps(CALIBRATION | {"width_px": 1280}))
    assert run(["camera", "view", str(files / "in"), "--calibration", str(files / "lens.yaml")]) == 2
    assert "640x360, the calibration" in capsys.readouterr().err
    (files / "lens.yaml").write_text("model: plumb_bob\nfx_pixels: 3\n")
    assert run(["camera", "view", str(files / "in"), "--calibration", str(files / "lens.yaml")]) == 2
    assert "lens.yaml:2: fx_pixels: unknown key, did you mean" in capsys.readouterr().err
    (files / "taken").write_text("")
    assert run(["camera", "view", str(files / "in"), "-o", str(files / "taken" / "below")]) == 2
    assert "cannot be made" in capsys.readouterr().err
    assert run(["camera", "view", str(files / "in"), "--dictionary", "DICT_APRILTAG_36H1"]) == 2
    assert "did you mean DICT_APRILTAG_36H1" in capsys.readouterr().err
    assert run(["camera", "view", str(files / "in"), "--size-mm", "100"]) == 2
    assert "belongs to tags (--dictionary)" in capsys.readouterr().err
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert run(["camera", "view", str(files / "in"), "--stream", "--port", port]) == 2
    assert f"port {port} cannot be used" in capsys.readouterr().err


def test_a_stream_is_one_that_our_own_reader_understands():
    stream = PictureServer(0)
    jpeg = cv2.imencode(".jpg", picture())[1].tobytes()
    halt = threading.Event()

    def show():
        while not halt.wait(0.02):
            stream.show(jpeg)

    shower = threading.Thread(target=show)
    shower.start()
    try:
        with urllib.request.urlopen(stream.url, timeout=5.0) as answer:
            reader, parts = MultipartParser(b"skein"), []
            for _ in range(200):
                parts += reader.feed(answer.read1(65536))
                if parts:
                    break
    finally:
        halt.set()
        shower.join()
        stream.close()
    assert parts[0] == jpeg
