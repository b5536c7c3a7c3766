"""One set of files as arrays: `NAME.dat` or `NAME.dat.xz` in a folder.

Leung, Halpern, Barfoot, Liu, The UTIAS multi-robot cooperative localization and mapping dataset, IJRR 30(8), 2011.
Measurements name barcodes; `Barcodes.dat` has their owners. "Odometry" is the commanded speed.
"""

import lzma
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from groundstation.arrays import Array
from groundstation.errors import OperatorMistake

ROBOTS = range(1, 6)


class DatasetError(OperatorMistake):
    """A file of the set is missing or malformed."""


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot's odometry (n, 3) t, v, w; readings (m, 4) t, subject, range, bearing; truth (k, 4) t, x, y, yaw.

    True headings are unwrapped; readings of unknown barcodes are left out.
    """

    odometry: Array
    readings: Array
    truth: Array

    def truth_at(self, t: Array) -> Array:
        """Return the true x, y, yaw (n, 3) at times within the set."""
        return np.column_stack([np.interp(t, self.truth[:, 0], self.truth[:, i]) for i in (1, 2, 3)])


@dataclass(frozen=True, slots=True)
class Dataset:
    """All robots by number, landmarks as {number: (x, y)}, and the time span that all of them cover [s]."""

    robots: dict[int, Robot]
    landmarks: dict[int, tuple[float, float]]
    start_s: float
    end_s: float


def read_dataset(folder: Path) -> Dataset:
    """Return the set in a folder; raises DatasetError naming the file at fault."""
    if not folder.is_dir():
        raise DatasetError(f"{folder}: there is no such folder")
    subjects = {int(barcode): int(number) for number, barcode in _table(folder, "Barcodes", 2)}
    landmarks = {int(row[0]): (float(row[1]), float(row[2])) for row in _table(folder, "Landmark_Groundtruth", 5)}
    robots = {number: _robot(folder, number, subjects) for number in ROBOTS}
    start = max(max(robot.truth[0, 0], robot.odometry[0, 0]) for robot in robots.values())
    end = min(min(robot.truth[-1, 0], robot.odometry[-1, 0]) for robot in robots.values())
    if end <= start:
        raise DatasetError(f"{folder}: the robots' files do not overlap in time")
    return Dataset(robots, landmarks, float(start), float(end))


def _robot(folder: Path, number: int, subjects: dict[int, int]) -> Robot:
    readings = _table(folder, f"Robot{number}_Measurement", 4)
    known = np.array([int(code) in subjects for code in readings[:, 1]])
    readings = readings[known]
    readings[:, 1] = [subjects[int(code)] for code in readings[:, 1]]
    truth = _table(folder, f"Robot{number}_Groundtruth", 4)
    truth[:, 3] = np.unwrap(truth[:, 3])
    return Robot(_table(folder, f"Robot{number}_Odometry", 3), readings, truth)


def _table(folder: Path, name: str, columns: int) -> Array:
    plain, packed = folder / f"{name}.dat", folder / f"{name}.dat.xz"
    path = plain if plain.exists() else packed
    if not path.exists():
        raise DatasetError(
            f"{folder}: neither {plain.name} nor {packed.name} is there; is it a folder of one MRCLAM set?"
        )
    try:
        data = path.read_bytes() if path == plain else lzma.decompress(path.read_bytes())
        lines = data.decode("ascii").splitlines()
        said = [line for line in lines if line.partition("#")[0].strip()]
        table = np.loadtxt(said, comments="#", ndmin=2, dtype=np.float64) if said else np.empty((0, 0))
    except (OSError, ValueError, lzma.LZMAError) as error:
        raise DatasetError(f"{path}: not readable as a table of numbers ({error})") from error
    if table.size == 0 or table.shape[1] != columns or not np.isfinite(table).all():
        found = f"{table.shape[1]} columns" if table.shape[1] != columns else "infinity, or what is no number"
        raise DatasetError(f"{path}: expected lines of {columns} numbers (found {found if table.size else 'none'})")
    table = table[np.argsort(table[:, 0], kind="stable")] if name.startswith("Robot") else table
    return np.asarray(table)
