"""Calibration files of other programs: the same lens, or a one-line reason for refusal."""

from collections.abc import Callable
from pathlib import Path

import pytest

from groundstation.errors import SettingsError
from groundstation.settings.calibration_file import load_calibration
from groundstation.settings.room import CalibrationSettings

ROS = """\
image_width: 640
image_height: 360
camera_name: front
camera_matrix: {rows: 3, cols: 3, data: [561.5, 0, 320.25, 0, 562.5, 170.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.5, 0.25, 0.01, -0.002, 0.03]}
"""
OPENCV = """\
%YAML:1.0
---
image_width: 640
image_height: 360
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.615e+02, 0., 320.25, 0., 562.5, 170.5, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -0.5, 2.5e-01, 0.01, -2.e-03, 0.03 ]
avg_reprojection_error: 4.e-01
"""
KALIBR = """\
cam0:
  camera_model: pinhole
  intrinsics: [561.5, 562.5, 320.25, 170.5]
  distortion_model: radtan
  distortion_coeffs: [-0.5, 0.25, 0.01, -0.002]
  resolution: [640, 360]
"""
EUROC = """\
sensor_type: camera
camera_model: pinhole
intrinsics: [561.5, 562.5, 320.25, 170.5] # fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.5, 0.25, 0.01, -0.002]
resolution: [640, 360]
"""
ROS_2_TOPIC = """\
header:
  stamp: {sec: 1662013622, nanosec: 672922214}
  frame_id: front
height: 360
width: 640
distortion_model: plumb_bob
d: [-0.5, 0.25, 0.01, -0.002, 0.03]
k: [561.5, 0.0, 320.25, 0.0, 562.5, 170.5, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
binning_x: 0
binning_y: 0
---
"""
ROS_1_TOPIC = ROS_2_TOPIC.replace("\nd:", "\nD:").replace("\nk:", "\nK:")

Reader = Callable[[str], CalibrationSettings]


@pytest.fixture
def lens_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Reader:
    """Return the lens of a calibration file `lens.yaml` with a text."""
    monkeypatch.chdir(tmp_path)

    def read(text: str) -> CalibrationSettings:
        Path("lens.yaml").write_text(text, encoding="utf-8")
        return load_calibration(Path("lens.yaml"))

    return read


@pytest.mark.parametrize(
    ("text", "k3", "residual_px"),
    [
        (ROS, 0.03, 0.2),
        (OPENCV, 0.03, 0.4),
        (KALIBR, 0.0, 0.2),
        (EUROC, 0.0, 0.2),
        (ROS_2_TOPIC, 0.03, 0.2),
        (ROS_1_TOPIC, 0.03, 0.2),
    ],
    ids=["ros", "opencv", "kalibr", "euroc", "ros 2 topic", "ros 1 topic"],
)
def test_a_calibration_of_another_program_is_the_same_lens(
    lens_of: Reader, text: str, k3: float, residual_px: float
) -> None:
    lens = lens_of(text)
    assert (lens.width_px, lens.height_px) == (640, 360)
    assert (lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px) == (561.5, 562.5, 320.25, 170.5)
    assert lens.distortion == (-0.5, 0.25, 0.01, -0.002, k3)
    assert lens.residual_px == residual_px


def test_coefficients_beyond_ours_may_be_zero(lens_of: Reader) -> None:
    eight = ROS.replace("plumb_bob", "rational_polynomial").replace("0.03]", "0.03, 0, 0, 0]")
    assert lens_of(eight).distortion == (-0.5, 0.25, 0.01, -0.002, 0.03)


def test_opencvs_published_calibration_is_read(real_data: Callable[[str], Path]) -> None:
    lens = load_calibration(real_data("camera_calibration") / "left_intrinsics.yml")
    assert (lens.width_px, lens.height_px) == (640, 480)
    assert lens.fx_px == pytest.approx(535.92, abs=0.01)
    assert lens.residual_px == pytest.approx(0.393, abs=0.001)


@pytest.mark.parametrize(
    ("text", "old", "new", "told"),
    [
        (ROS, "plumb_bob", "equidistant", "lens.yaml:5: distortion_model: equidistant is another model"),
        (ROS, "0.03]", "0.03, 0.1, 0, 0]", "lens.yaml:6: distortion_coefficients: has 8 coefficients"),
        (OPENCV, ", 0.03 ]", " ]", "lens.yaml:10: distortion_coefficients: has 4 coefficients and no distortion_model"),
        (OPENCV, "avg_reprojection", "fisheye_model: 1\navg_reprojection", "lens.yaml:15: fisheye_model: a fisheye's"),
        (OPENCV, "image_width: 640", "", "lens.yaml:4: a calibration of another program that lacks image_width"),
        (OPENCV, "02, 0., 320", "02, 0.7, 320", "lens.yaml:5: camera_matrix: must be fx 0 cx, 0 fy cy, 0 0 1"),
        (OPENCV, "5.615e+02", "-5.615e+02", "lens.yaml:9: camera_matrix.data[0]: must be > 0"),
        (OPENCV, "2.5e-01", ".Nan", "lens.yaml:14: distortion_coefficients.data[1]: must be a number"),
        (ROS_2_TOPIC, "binning_y: 0", "binning_y: 2", "lens.yaml:11: binning_y: its pictures are reduced"),
        (ROS_2_TOPIC, "plumb_bob", "equidistant", "lens.yaml:6: distortion_model: equidistant is another model"),
        (ROS_2_TOPIC, "\nd:", "\nx:", "lens.yaml:1: a calibration of another program that lacks d"),
        (KALIBR, "pinhole", "omni", "lens.yaml:2: cam0.camera_model: omni is no pinhole"),
        (KALIBR, "radtan", "equidistant", "lens.yaml:4: cam0.distortion_model: equidistant is another model"),
        (KALIBR, "cam0:", "cam1: {intrinsics: [1, 1, 0, 0]}\ncam0:", "lens.yaml:1: holds 2 cameras (cam1, cam0)"),
    ],
)
def test_foreign_lens_models_are_refused_in_one_line(lens_of: Reader, text: str, old: str, new: str, told: str) -> None:
    assert text.count(old) == 1
    with pytest.raises(SettingsError) as caught:
        lens_of(text.replace(old, new))
    (problem,) = caught.value.problems
    assert problem.startswith(told)


def test_opencvs_xml_is_named(lens_of: Reader) -> None:
    with pytest.raises(SettingsError, match=r"lens.yaml:1: is XML: let OpenCV write it as YAML"):
        lens_of('<?xml version="1.0"?>\n<opencv_storage></opencv_storage>')
