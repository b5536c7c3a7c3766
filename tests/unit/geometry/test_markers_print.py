"""Printed markers: exact to hundredths of a millimetre, refused if too large, and readable by the detector."""

import re
import shutil
import subprocess

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from drivers.camera.detect import Window, find_board
from drivers.camera.dictionaries import black_cells, dictionary_of
from drivers.camera.markers import read_bar
from groundstation.cli.markers import markers
from groundstation.geometry.board import CODE_WORDS
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.tag import DICTIONARIES, SquareTag

MM = 72.0 / 25.4


def print_pdf(tmp_path, *arguments, code=0):
    path = tmp_path / "out.pdf"
    result = CliRunner().invoke(markers, ["print", *arguments, "-o", str(path)])
    assert result.exit_code == code, result.output
    return path.read_bytes() if code == 0 else result.output


def pages_of(pdf):
    """Return (media box [mm], rectangles x y w h [mm]) of each page, read from the operators of the file."""
    pages = []
    boxes = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    for box, stream in zip(boxes, re.findall(rb"stream\n(.*?)\nendstream", pdf, re.S), strict=True):
        scaling = re.match(rb"([\d.]+) 0 0 ([\d.]+) 0 0 cm", stream)
        assert scaling is not None
        scale = float(scaling[1])
        numbers = re.findall(rb"0 g (-?[\d.]+) (-?[\d.]+) ([\d.]+) ([\d.]+) re f", stream)
        pages.append(([float(side) / MM for side in box], np.array(numbers, dtype=float).reshape(-1, 4) * scale / MM))
    return pages


def test_squares_are_exact_on_paper(tmp_path):
    _, (box, found) = pages_of(print_pdf(tmp_path, "--id", "3"))
    assert box == pytest.approx([297.0, 210.0], abs=0.01)
    squares = found[np.isclose(found[:, 2], 44.0, atol=0.05) & np.isclose(found[:, 3], 44.0, atol=0.05)]
    assert len(squares) == 10
    assert np.ptp(squares[:, 0]) == pytest.approx(4 * 44.0, abs=0.05)
    assert np.ptp(squares[:, 1]) == pytest.approx(3 * 44.0, abs=0.05)
    cells = found[np.isclose(found[:, 2], 28.0, atol=0.05)]
    assert cells[:, 0] == pytest.approx(squares[:, 0].max() + 44.0 + 0.35 * 44.0, abs=0.05)
    assert cells[:, 3].sum() == pytest.approx(22.0 * CODE_WORDS[3].sum(), abs=0.05)


def test_several_markers_are_several_pages_after_the_notes(tmp_path):
    pdf = print_pdf(tmp_path, "--id", "0", "--id", "15", "--id", "7", "--square-mm", "60", "--size", "A3")
    pages = pages_of(pdf)
    assert len(pages) == 4
    assert len(pages[0][1]) == 0
    assert b"the row of five squares must measure 300.0 mm" in pdf
    for word in (b"100 mm", b"bar forward", b"Cut along"):
        assert word in pdf


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--id", "3", "--square-mm", "60"), "at most --square-mm 44 fits"),
        (("--id", "16"), "0..15"),
        (("--id", "3", "--size", "B9"), "WIDTHxHEIGHT"),
        (("--id", "3", "--square-mm", "-4"), "5..200"),
        (("--id", "3", "--square-mm", "nan"), "5..200"),
        (("--id", "3", "--square-mm", "0"), "5..200"),
        (("--id", "3", "--size-mm", "100"), "belongs to tags"),
        (("--id", "3", "--dictionary", "DICT_X"), "dictionary must be one of"),
        (("--id", "600", "--dictionary", "DICT_APRILTAG_36H11"), "0..586"),
        (("--id", "6", "--dictionary", "DICT_APRILTAG_36H11", "--size-mm", "300"), "at most --size-mm 168 fits"),
    ],
)
def test_unprintable_markers_are_refused_with_a_remedy(tmp_path, arguments, says):
    assert says in print_pdf(tmp_path, *arguments, code=2)


def test_own_paper_sizes(tmp_path):
    (_, _), (box, _) = pages_of(print_pdf(tmp_path, "--id", "3", "--square-mm", "80", "--size", "600x500"))
    assert box == pytest.approx([600.0, 500.0], abs=0.01)


def test_the_dictionaries_are_those_of_opencv():
    for name, (count, bits) in DICTIONARIES.items():
        held = dictionary_of(name)
        assert (held.bytesList.shape[0], held.markerSize) == (count, bits)


def rasterised(tmp_path, dots_per_inch):
    if shutil.which("pdftoppm") is None:
        pytest.skip("needs pdftoppm (poppler-utils)")
    command = ["pdftoppm", "-r", str(dots_per_inch), "-gray", "-png", str(tmp_path / "out.pdf"), str(tmp_path / "page")]
    subprocess.run(command, check=True, timeout=60)
    return [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted(tmp_path.glob("page*.png"))]


@pytest.mark.parametrize("code", [0, 3, 15])
def test_the_detector_reads_the_printed_page(tmp_path, code):
    print_pdf(tmp_path, "--id", str(code))
    _, page = rasterised(tmp_path, 127)  # five pixels per millimetre: edges of 44 mm squares fall between pixels
    height, width = page.shape
    find = find_board(page, Window(0, 0, width, height), 220.0)
    assert find is not None
    assert np.diff(find.corners.reshape(3, 4, 2)[:, :, 0], axis=1) == pytest.approx(220.0, abs=0.25)
    lens = CameraIntrinsics(width, height, 1000.0, 1000.0, width / 2, height / 2)
    reading = read_bar(page, find, lens)
    assert reading is not None
    assert (reading.code, reading.margin > 3.0) == (code, True)


def test_opencv_reads_the_printed_tag(tmp_path):
    print_pdf(tmp_path, "--id", "7", "--dictionary", "DICT_APRILTAG_36H11", "--size-mm", "150")
    _, page = rasterised(tmp_path, 100)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary_of("DICT_APRILTAG_36H11")).detectMarkers(page)
    assert np.ravel(ids).tolist() == [7]
    sides = np.linalg.norm(np.diff(np.reshape(corners, (4, 2)), axis=0), axis=1)
    assert sides == pytest.approx(150.0 / 25.4 * 100, abs=2.0)


def test_tags_have_their_border():
    cells = np.array(black_cells(SquareTag("DICT_4X4_50", 0, 100.0)))
    assert cells.shape == (6, 6)
    assert cells[0].all()
    assert cells[:, 0].all()
    assert not cells.all()
