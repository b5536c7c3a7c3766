"""Folders of MRCLAM sets: plain or packed files, barcodes instead of subjects, and operator mistakes."""

import json
import lzma
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from groundstation.cli.experiment_mrclam import mrclam
from groundstation.errors import GroundStationError
from groundstation.experiments.mrclam.dataset import read_dataset
from groundstation.experiments.mrclam.run import run_scenario
from groundstation.experiments.mrclam.scenarios import SCENARIOS, camera_sightings

BARCODES = {1: 5, 2: 14, 3: 41, 4: 32, 5: 23, 6: 72, 7: 27}
LANDMARKS = {6: (2.0, -1.0), 7: (2.0, 3.0)}


def write(folder: Path, name: str, rows: Sequence[tuple[float, ...]], packed: bool = False) -> None:
    text = "# columns\n" + "\n".join(" \t ".join(f"{value:.6f}" for value in row) for row in rows) + "\n"
    if packed:
        (folder / f"{name}.dat.xz").write_bytes(lzma.compress(text.encode()))
    else:
        (folder / f"{name}.dat").write_text(text)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Six seconds of five robots in a row that drive along x at 0.1 m/s and observe landmark 7 and robot 1."""
    write(tmp_path, "Barcodes", [(float(k), float(v)) for k, v in BARCODES.items()], packed=True)
    write(tmp_path, "Landmark_Groundtruth", [(k, *place, 0.001, 0.001) for k, place in LANDMARKS.items()])
    for number in range(1, 6):
        ticks = np.arange(0.0, 6.0, 0.1)
        y = 0.5 * number
        write(tmp_path, f"Robot{number}_Groundtruth", [(100 + t, 0.1 * t, y, 0.0) for t in ticks], packed=number == 3)
        write(tmp_path, f"Robot{number}_Odometry", [(100 + t, 0.1, 0.0) for t in ticks])
        readings = []
        for t in ticks[::3]:
            dx, dy = LANDMARKS[7][0] - 0.1 * t, LANDMARKS[7][1] - y
            readings.append((100 + t, BARCODES[7], dx, math.atan2(dy, dx)))
            readings.append((100 + t, 999, 1.0, 0.0))  # a barcode of no subject
        write(tmp_path, f"Robot{number}_Measurement", readings)
    return tmp_path


def test_readings_are_of_subjects_and_unknown_barcodes_are_left_out(folder: Path) -> None:
    data = read_dataset(folder)
    assert set(data.landmarks) == {6, 7}
    assert {int(subject) for subject in data.robots[2].readings[:, 1]} == {7}
    np.testing.assert_allclose(data.robots[3].truth_at(np.array([102.05])), [[0.205, 1.5, 0.0]], atol=1e-9)


def test_a_short_set_runs_from_end_to_end(folder: Path) -> None:
    result = run_scenario(read_dataset(folder), SCENARIOS[0], robot_readings=True)
    assert result.rmse_m < 0.05
    assert not result.lost


def test_dark_spells_and_the_room_s_other_half_show_nothing(folder: Path) -> None:
    data = read_dataset(folder)
    half = camera_sightings(data, SCENARIOS[2], seed=1)
    assert len(half[1]) == 0  # at y = 0.5, below the middle of the landmarks
    assert len(half[5]) > 20
    assert (
        sum(map(len, camera_sightings(data, SCENARIOS[3], seed=1).values())) == 0
    )  # two minutes are longer than the set


@pytest.mark.parametrize(
    ("break_it", "said"),
    [
        (lambda f: (f / "Robot4_Odometry.dat").unlink(), "neither Robot4_Odometry.dat nor"),
        (lambda f: (f / "Robot4_Odometry.dat").write_text("# nothing\nhello world\n"), "not readable as a table"),
        (lambda f: (f / "Landmark_Groundtruth.dat").write_text("1 2 3\n"), "expected lines of 5 numbers"),
        (lambda f: (f / "Barcodes.dat.xz").write_bytes(b"no archive"), "Barcodes.dat.xz"),
        (lambda f: (f / "Barcodes.dat").write_text("# subject, barcode\n"), "expected lines of 2 numbers .found none"),
        (lambda f: write(f, "Robot1_Odometry", [(5.0, math.nan, 0.0)]), "what is no number"),
        (lambda f: write(f, "Robot1_Odometry", [(5.0, 0.1, 0.0)]), "do not overlap in time"),
    ],
)
def test_errors_of_a_data_set_folder_are_named(folder: Path, break_it, said: str) -> None:
    break_it(folder)
    with pytest.raises(GroundStationError, match=said):
        read_dataset(folder)


def test_a_span_too_short_to_judge_is_named(folder: Path) -> None:
    with pytest.raises(GroundStationError, match="longer --span"):
        run_scenario(read_dataset(folder), SCENARIOS[0], robot_readings=True, span=(0.5, 0.501))


def test_the_verb_writes_json_and_refuses_bad_spans(folder: Path) -> None:
    refused = CliRunner().invoke(mrclam, [str(folder), "--span", "0.9", "0.1"])
    assert refused.exit_code == 2
    assert "--span" in refused.output
    done = CliRunner().invoke(mrclam, [str(folder), "--json"])
    assert done.exit_code == 0, done.output
    rows = json.loads(done.stdout)["results"]
    assert len(rows) == 2 * len(SCENARIOS)
    assert rows[1]["robot_readings"] and rows[1]["rmse_m"] < 0.05
