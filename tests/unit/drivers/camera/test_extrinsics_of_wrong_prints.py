"""Extrinsics from floor markers whose prints may have another size than was said."""

import numpy as np
from floor_pictures import CEILING, HEADINGS, LENS, PLACES, drawn, files_for, markers
from ruamel.yaml import YAML

from drivers.camera.calibration.extrinsics import Mark, place_camera
from drivers.camera.calibration.static_markers import Steady
from groundstation.cli.main import run
from groundstation.geometry.board import Checkerboard
from groundstation.geometry.rotations import rotation_z


def measured(capsys, *arguments):
    """Run `calibrate extrinsics`; returns exit code, its YAML, and its whole output."""
    code = run(["calibrate", "extrinsics", *arguments])
    said = capsys.readouterr()
    return code, YAML(typ="safe").load(said.out), said.out + said.err


def test_prints_of_a_wrong_size_are_named_and_covered_by_the_deviations(tmp_path, capsys):
    """Prints 3 % small: markers far apart show it; of close ones only the deviation can tell."""
    rng = np.random.default_rng(2)
    for spread, worst_m in ((1.0, 0.03), (0.3, 0.1)):
        places = {code: (spread * x, spread * y) for code, (x, y) in PLACES.items()}
        for _ in range(4):
            steady = {}
            for code, (x, y) in places.items():
                points = 0.97 * Checkerboard(code, 44.0).corners() @ rotation_z(HEADINGS[code]).T
                points += (x + rng.normal(0, 0.005), y + rng.normal(0, 0.005), 0.0)
                seen = LENS.project(CEILING.inverse().apply(points)) + rng.normal(0.0, 0.1, (12, 2))
                steady[code] = Steady(seen, 0.0, 20, moved=False)
            marks = [Mark(code, (*place, 0.0)) for code, place in places.items()]
            found = place_camera(marks, steady, LENS, 44.0, 0.005)
            error_m = abs(found.pose.translation[2] - CEILING.translation[2])
            assert not found.misplaced
            assert error_m < min(worst_m, 3.0 * found.position_std_m[2]), (spread, error_m, found.position_std_m)
    picture = drawn(CEILING, LENS, {code: (*PLACES[code], 0.0, HEADINGS[code]) for code in PLACES})
    folder, calibration = files_for(tmp_path, LENS, picture, 1)
    code, lines, said = measured(capsys, folder, "--calibration", calibration, "--square-mm=45.4", *markers())
    assert code == 0 and "3.0 % too small (squares of 44.0 mm, not 45.4)" in said and "further apart" not in said
    assert np.allclose(lines["position_m"], CEILING.translation, atol=0.02)


def test_markers_close_together_are_asked_to_be_laid_further_apart(tmp_path, capsys):
    places = {1: (0.2, 0.15), 2: (-0.15, 0.2)}
    picture = drawn(CEILING, LENS, {code: (*places[code], 0.0, HEADINGS[code]) for code in places})
    folder, calibration = files_for(tmp_path, LENS, picture, 1)
    code, lines, said = measured(capsys, folder, "--calibration", calibration, *markers(places))
    assert code == 0 and "lay them further apart" in said and "printed" not in said
    # What a print checked with a ruler leaves open counts: 0.3 % of the distance.
    assert lines["position_std_m"] > 0.8 * 0.003 * CEILING.translation[2]
