"""Motion and observation models: exact Jacobians against central differences, yaw near +-pi included."""

import math

import numpy as np
import pytest

from groundstation.arrays import Vector
from groundstation.estimation.chi_square import gate
from groundstation.estimation.filter_state import Belief, Deferred
from groundstation.estimation.model_kernels import call_locate
from groundstation.estimation.models import (
    Anchor,
    CommandedRobot,
    ConstantVelocityTarget,
    CoordinatedTurnTarget,
    FixedMount,
    HeadingSensor,
    Landmark,
    ManoeuvringTarget,
    MountedCamera,
    OdometryRobot,
    RangeBearingSensor,
    RangeSensor,
    ReportedVelocity,
)
from groundstation.estimation.models.odometry_robot import SLOW_STATES
from groundstation.estimation.models.protocol import MotionModel, ObservationModel
from groundstation.estimation.motion import predict
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters
from groundstation.estimation.records import EntityMemory, EventRow, Innovation, SensorRow
from groundstation.estimation.tables import empty_state, tables_from_parameters, width_of
from groundstation.estimation.update import linearise
from groundstation.geometry.rotations import base_from_tilted_optical, rotation_from_euler
from groundstation.kernel import Rows, kernel

YAWS = (0.3, math.pi - 1e-9, -math.pi + 1e-9, 3.1, -2.0)
ROBOT = OdometryRobot(marker_position_m=(0.05, -0.03, 0.08), slow_states=SLOW_STATES, velocity_bias_std_m_s=0.1)
ENTITIES: dict[str, MotionModel] = {
    "full": ROBOT,
    "bare": OdometryRobot(marker_position_m=(0.05, -0.03, 0.08), slow_states=()),
    "ground": CommandedRobot(marker_position_m=(0.1, 0.02, 0.0)),
    "straight": ConstantVelocityTarget(),
    "pointing": ConstantVelocityTarget(heading=True),
    "turning": CoordinatedTurnTarget(),
    "turning_pointing": CoordinatedTurnTarget(heading=True),
    "mount": FixedMount((0.0, 0.0, 4.0), 0.003, 0.01),
    "post": Landmark((1.5, -0.7, 0.2)),
    "anchor": Anchor((-2.5, 1.9, 2.4)),
}
TILTED = base_from_tilted_optical(math.radians(45))
SENSORS: dict[str, ObservationModel] = {
    **{name: MountedCamera(name, TILTED, (0.09, 0.01, -0.02)) for name in ("full", "bare", "mount")},
    "both": RangeBearingSensor("ground"),
    "depth": RangeBearingSensor("ground", is_depth=True),
    "range": RangeBearingSensor("ground", "range"),
    "bearing": RangeBearingSensor("full", "bearing"),
    "heading": HeadingSensor("full"),
    "radio": RangeSensor("anchor", (0.12, -0.05, 0.06)),
    "straight_odometry": ReportedVelocity("straight"),
    "pointing_odometry": ReportedVelocity("pointing"),
}
TABLES = tables_from_parameters(EstimatorParameters(ENTITIES, SENSORS))
NAMES = list(ENTITIES)


def random_state(seed: int, yaw: float) -> tuple[np.ndarray, Rows[EntityMemory]]:
    """Return a state with every heading at `yaw`, and inputs of all driven entities."""
    rng = np.random.default_rng(seed)
    state = empty_state(TABLES, [True] * len(NAMES))
    mean, memory = state.means[0], state.memory
    mean[:] = rng.normal(0.0, 0.3, mean.size)
    for index, model in enumerate(ENTITIES.values()):
        part = TABLES.part(index)
        for offset, label in enumerate(model.labels):
            if label == "yaw":
                mean[part.start + offset] = yaw
            if label == "velocity_scale":
                mean[part.start + offset] = 1.1
    mean[TABLES.part(NAMES.index("mount")).start + 2] = 4.0
    memory["active"] = 1
    memory["held_vx"], memory["held_vy"], memory["yaw_rate"] = 0.5, -0.2, 0.8
    memory["slow_vx"], memory["slow_vy"] = 0.4, -0.1
    return mean, memory


def belief_with(mean: np.ndarray, P: np.ndarray, memory: Rows[EntityMemory] | None = None) -> Belief:
    memory = EntityMemory.rows(len(NAMES)) if memory is None else memory
    return Belief(mean, P, TABLES.entities[0], memory)


def headings() -> list[int]:
    return [
        TABLES.part(i).start + model.labels.index("yaw")
        for i, model in enumerate(ENTITIES.values())
        if "yaw" in model.labels
    ]


def difference(a: np.ndarray, b: np.ndarray, angles: list[int]) -> np.ndarray:
    d = a - b
    for index in angles:
        d[index] = math.remainder(d[index], math.tau)
    return d


@pytest.mark.parametrize("yaw", YAWS)
@pytest.mark.parametrize("dt", [0.01, 0.2])
def test_prediction_jacobian_is_that_of_the_mean(yaw: float, dt: float) -> None:
    mean, memory = random_state(1, yaw)
    n, step, rng = mean.size, 1e-6, np.random.default_rng(2)

    def moved(x):
        x = x.copy()
        predict(belief_with(x, np.zeros((n, n)), memory), dt)
        return x

    F = np.empty((n, n))
    for j in range(n):
        e = step * np.eye(n)[j]
        F[:, j] = difference(moved(mean + e), moved(mean - e), headings()) / (2 * step)
    Q = np.zeros((n, n))
    predict(belief_with(mean.copy(), Q, memory), dt)
    assert np.linalg.eigvalsh(Q)[0] > -1e-15
    root = rng.normal(size=(n, n))
    P = root @ root.T
    predicted = P.copy()
    predict(belief_with(mean.copy(), predicted, memory), dt)
    np.testing.assert_allclose(predicted, F @ P @ F.T + Q, atol=2e-8 * np.abs(P).max())
    assert np.array_equal(predicted, predicted.T)


@pytest.mark.parametrize("rate", [0.0, 1e-9, 2e-4, -3e-3, 0.7])
def test_turning_is_exact_at_any_rate(rate: float) -> None:
    """Compared with a thousand small steps, also where series replace quotients."""
    part = TABLES.part(NAMES.index("turning"))
    mean, memory = random_state(3, 0.0)
    memory["active"] = 0
    memory["active"][NAMES.index("turning")] = 1
    mean[part] = (0.0, 0.0, 0.3, 0.1, rate)
    predict(belief_with(mean, np.zeros((mean.size, mean.size)), memory), 0.5)
    place, velocity = 0j, 0.3 + 0.1j
    for _ in range(1000):
        place += 0.0005 * velocity * np.exp(0.5j * rate * 0.0005)
        velocity *= np.exp(1j * rate * 0.0005)
    np.testing.assert_allclose(mean[part][:4], [place.real, place.imag, velocity.real, velocity.imag], atol=1e-8)


def observed(mean: np.ndarray, sensor: str, subject: str, rows: int, roll: float = 0.05, pitch: float = -0.08):
    """Return h(x) and its Jacobian by the whole state, through the filter's own linearisation."""
    number = list(SENSORS).index(sensor)
    observer = NAMES.index(SENSORS[sensor].carrier)
    event = EventRow.row(
        observer=observer, subject=NAMES.index(subject), sensor=number, roll=roll, pitch=pitch, subject_roll=0.06,
        subject_pitch=-0.11,
    )  # fmt: skip
    innovation, n = Innovation.rows(1), width_of(TABLES)
    innovation["R"] = np.eye(4)
    belief = belief_with(np.append(mean, np.zeros(n - mean.size)), np.eye(n))
    deferred, HP = Deferred(np.zeros((0, n)), np.zeros(1, dtype=np.int64)), np.zeros((4, n))
    linearise(belief, deferred, TABLES.sensors[number], event, rows, np.zeros(4), innovation[0], HP)
    H = np.zeros((rows, mean.size))
    prediction = innovation["prediction"][0]
    for block, index in ((prediction["H_observer"], observer), (prediction["H_subject"], NAMES.index(subject))):
        part = TABLES.part(index)
        H[:, part] += block[:rows, : part.stop - part.start]
    return -innovation["y"][0, :rows], H, event


PAIRS = [
    ("full", "bare", 4),
    ("bare", "full", 4),
    ("mount", "full", 4),
    ("full", "straight", 3),
    ("bare", "turning", 3),
    ("full", "pointing", 4),
    ("full", "turning_pointing", 4),
    ("full", "ground", 4),
    ("full", "post", 3),
    ("radio", "full", 1),
    ("radio", "ground", 1),
    ("both", "post", 2),
    ("both", "full", 2),
    ("both", "turning", 2),
    ("depth", "post", 2),
    ("depth", "turning", 2),
    ("range", "bare", 1),
    ("bearing", "straight", 1),
    ("heading", "full", 1),
    ("straight_odometry", "straight", 1),
    ("straight_odometry", "straight", 2),
    ("pointing_odometry", "pointing", 2),
]


@pytest.mark.parametrize("yaw", YAWS)
@pytest.mark.parametrize(("sensor", "subject", "rows"), PAIRS)
def test_observation_jacobians_agree_with_central_differences(sensor: str, subject: str, rows: int, yaw: float) -> None:
    step, angles = 1e-6, list(SENSORS[sensor].angles)
    for seed in range(3):
        mean, _ = random_state(seed, yaw)
        _, H, _ = observed(mean, sensor, subject, rows)
        numeric = np.empty_like(H)
        for j in range(mean.size):
            e = step * np.eye(mean.size)[j]
            ahead, behind = (observed(mean + sign * e, sensor, subject, rows)[0] for sign in (1, -1))
            numeric[:, j] = difference(ahead, behind, [a for a in angles if a < rows]) / (2 * step)
        np.testing.assert_allclose(H, numeric, atol=2e-7 * max(1.0, np.abs(H).max() ** 2))


def test_a_camera_follows_the_geometry_of_the_frames() -> None:
    """Against rotation matrices written out independently of the kernel."""
    mean, _ = random_state(0, 0.7)
    observer, subject = TABLES.part(NAMES.index("full")), TABLES.part(NAMES.index("bare"))
    mean[observer][:] = 0.0
    mean[observer][:4] = (0.1, -0.2, 2.1, 0.7)
    mean[subject] = (1.2, 0.4, 1.1, 2.0)
    h, _, _ = observed(mean, "full", "bare", 4)
    marker = np.array([1.2, 0.4, 1.1]) + rotation_from_euler(0.06, -0.11, 2.0) @ (0.05, -0.03, 0.08)
    base = rotation_from_euler(0.05, -0.08, 0.7)
    expected = TILTED.T @ (base.T @ (marker - (0.1, -0.2, 2.1)) - (0.09, 0.01, -0.02))
    np.testing.assert_allclose(h[:3], expected, atol=1e-12)
    assert h[3] == pytest.approx(1.3)


def test_a_marker_leans_by_what_its_vehicle_says_and_by_the_error_of_it() -> None:
    mean, _ = random_state(0, 0.7)
    mean[TABLES.part(NAMES.index("mount"))] = (0.0, 0.0, 4.0, 0.0, 0.0, 0.0)
    mean[TABLES.part(NAMES.index("full"))][:6] = (1.2, 0.4, 1.1, 2.0, -0.02, 0.03)
    h, _, _ = observed(mean, "mount", "full", 4, roll=0.0, pitch=0.0)
    marker = np.array([1.2, 0.4, 1.1]) + rotation_from_euler(0.04, -0.08, 2.0) @ (0.05, -0.03, 0.08)
    expected = TILTED.T @ (marker - (0.0, 0.0, 4.0) - (0.09, 0.01, -0.02))
    np.testing.assert_allclose(h[:3], expected, atol=1e-12)


def test_a_range_is_that_from_the_tag_to_the_anchor_and_its_bias() -> None:
    mean, _ = random_state(0, 0.7)
    mean[TABLES.part(NAMES.index("full"))][:6] = (0.4, -0.2, 1.1, 0.7, -0.02, 0.03)  # it leans more than it reports
    mean[TABLES.part(NAMES.index("anchor"))] = 0.07
    h, _, _ = observed(mean, "radio", "full", 1)
    tag = np.array([0.4, -0.2, 1.1]) + rotation_from_euler(0.04, -0.08, 0.7) @ (0.12, -0.05, 0.06)
    np.testing.assert_allclose(h, [np.linalg.norm(tag - (-2.5, 1.9, 2.4)) + 0.07], atol=1e-12)


def test_range_and_bearing_follow_plane_geometry() -> None:
    mean, _ = random_state(0, 0.0)
    mean[TABLES.part(NAMES.index("ground"))] = (0.5, -0.7, 0.0, math.pi / 2, 0.0, 0.0, 0.0, 0.0, 0.03, 0.02, -0.01)
    h, _, _ = observed(mean, "both", "post", 2)
    np.testing.assert_allclose(h, (1.05, -math.pi / 2 - 0.01), atol=1e-12)


def test_a_point_below_the_ceiling_camera_is_in_front_of_it() -> None:
    assert np.allclose(WORLD_FROM_DOWN.T @ (np.array([0.5, 0.3, 1.3]) - (0.0, 0.0, 4.2)), [0.5, -0.3, 2.9])


@kernel()
def locate(address: int, belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, pose: Vector) -> bool:
    return call_locate(address, (belief, sensor, event, z, pose))


@pytest.mark.parametrize("yaw", YAWS)
@pytest.mark.parametrize(("sensor", "subject", "rows"), [p for p in PAIRS if p[1] != "post" and p[0] != "radio"])
def test_an_observation_without_noise_gives_back_the_place(sensor: str, subject: str, rows: int, yaw: float) -> None:
    mean, _ = random_state(5, yaw)
    mean[TABLES.part(NAMES.index("ground")).start + 8 :][:3] = 0.0  # biases: located entities do not depend on them
    z = np.zeros(4)
    z[:rows], _, event = observed(mean, sensor, subject, rows)
    number, pose = list(SENSORS).index(sensor), np.zeros(4)
    row = TABLES.sensors[number]
    placed = locate(int(row["locate"]), belief_with(mean, np.eye(mean.size)), row, event, z, pose)
    if sensor in ("range", "bearing", "heading") or sensor.endswith("_odometry"):
        assert not placed
        return
    assert placed
    if rows == 4:
        model = ENTITIES[subject]
        at = [model.labels.index(label) if label in model.labels else None for label in ("x", "y", "z", "yaw")]
        block = mean[TABLES.part(NAMES.index(subject))]
        for value, offset in zip(pose, at, strict=True):
            if offset is not None:
                assert math.remainder(value - block[offset], math.tau) == pytest.approx(0.0, abs=1e-9)
    elif sensor == "both" and subject == "turning":
        np.testing.assert_allclose(pose[:2], mean[TABLES.part(NAMES.index(subject))][:2], atol=1e-9)


def test_modes_of_one_target_must_fit_together() -> None:
    with pytest.raises(ValueError, match="same labels"):
        ManoeuvringTarget((ConstantVelocityTarget(), CoordinatedTurnTarget()))
    with pytest.raises(ValueError, match="joint beliefs"):
        tables_from_parameters(EstimatorParameters({f"t{i}": ManoeuvringTarget() for i in range(4)}))
    chances = tables_from_parameters(
        EstimatorParameters({"a": ManoeuvringTarget(), "b": ManoeuvringTarget()})
    ).transition
    assert chances.shape == (4, 4)
    np.testing.assert_allclose(chances.sum(axis=1), 1.0)


def test_gates_are_chi_square_quantiles() -> None:
    # Tables of the chi-square distribution.
    assert gate(0.95, 1) == pytest.approx(3.841, abs=1e-3)
    assert gate(0.99, 2) == pytest.approx(9.210, abs=1e-3)
    assert gate(0.997, 3) == pytest.approx(13.931, abs=1e-3)
    assert gate(0.95, 4) == pytest.approx(9.488, abs=1e-3)
    with pytest.raises(ValueError, match="degrees"):
        gate(0.95, 5)
    with pytest.raises(ValueError, match="probability"):
        gate(1.0, 1)
