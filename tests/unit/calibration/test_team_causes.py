"""The smallest set of causes that explains the data, from the information matrix and vector."""

import math
from dataclasses import dataclass

import msgspec
import numpy as np
import pytest

from groundstation.arrays import Array, Vector
from groundstation.calibration.team_causes import Cause, causes, evidence, freed, posterior
from groundstation.calibration.team_figures import Figures, Suspicion
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import LensStd

SURVEYED = np.array([0.01, 0.01, 0.01])


@dataclass(frozen=True)
class Linear:
    """A recording that follows its linear model; share: the part of the evidence that a fit finds."""

    information: Array
    pull: Vector
    share: float = 1.0

    def log_evidence(self, sigma: Array) -> float:
        return self.share * evidence(self.information, self.pull, sigma)


def found_in(
    H: Array, errors: list[float], among: list[Suspicion], share: float = 1.0
) -> tuple[tuple[Cause, ...], Array]:
    recording = Linear(H, H @ np.array(errors), share)
    return causes(lambda sigma: recording, recording, SURVEYED, among)


def suspicions() -> list[Suspicion]:
    single = [Suspicion(name, "size", np.eye(3)[:, [i]], np.array([0.5])) for i, name in enumerate("abc")]
    return [*single, Suspicion("", "size", np.ones((3, 1)), np.array([0.5]))]


def test_figures_within_survey_accuracy_have_no_cause() -> None:
    H = np.diag([1e6, 1e6, 1e6])
    found, sigma = found_in(H, [0.01, -0.01, 0.005], suspicions())
    assert found == () and not freed(found).any()
    assert np.allclose(np.diag(sigma), SURVEYED**2)


def test_one_figure_and_all_alike_are_told_apart() -> None:
    H = np.diag([1e5, 1e5, 1e5])
    for errors, who in (([0.0, 0.2, 0.0], "b"), ([0.2, 0.2, 0.2], "")):
        found, sigma = found_in(H, list(errors), suspicions())
        assert [one.suspicion.who for one in found] == [who]
        mean, covariance = posterior(H, H @ np.array(errors), sigma)
        assert np.allclose(mean, errors, atol=3.0 * np.sqrt(np.diag(covariance)).max())


def test_causes_that_explain_it_as_well_are_rivals() -> None:
    direction = np.array([1.0, 1.0, 0.0])
    H = 1e5 * np.outer(direction, direction)
    found, _ = found_in(H, [0.2, 0.0, 0.0], suspicions()[:3])
    assert found[0].suspicion.who in "ab" and {one.who for one in found[0].rivals} == {"a", "b"} - {
        found[0].suspicion.who
    }


def test_a_figure_that_improves_no_fit_is_no_cause() -> None:
    H = np.diag([1e5, 1e5, 1e5])
    assert found_in(H, [0.0, 0.2, 0.0], suspicions())[0] != ()
    assert found_in(H, [0.0, 0.2, 0.0], suspicions(), share=1e-3)[0] == ()


@pytest.mark.parametrize(("what", "told"), [("size", True), ("velocity_delay", False)])
def test_a_cause_is_told_by_100_to_1_and_a_late_velocity_by_10000_to_1(what: str, told: bool) -> None:
    H, one = np.diag([1.5e4]), Suspicion("a", what, np.eye(1), np.array([0.06]))
    recording = Linear(H, H @ np.array([0.042]))
    narrow = np.array([0.006])
    lead = recording.log_evidence(np.diag(narrow**2) + 0.06**2) - recording.log_evidence(np.diag(narrow**2))
    assert math.log(100.0) < lead < math.log(1e4)
    assert bool(causes(lambda sigma: recording, recording, narrow, [one])[0]) is told


def test_every_figure_of_the_lab_has_a_survey_and_a_suspicion(lab_field: ResolvedField) -> None:
    figures = Figures(lab_field, tuple(lab_field.drones))
    covered = sum(np.any(s.directions != 0.0, axis=1) for s in figures.suspicions())
    assert (
        (np.asarray(covered) >= 1).all() and (figures.surveyed > 0.0).all() and (figures.wide >= figures.surveyed).all()
    )


def test_accuracies_of_mountings_and_lenses_are_taken_from_the_field(lab_field: ResolvedField) -> None:
    drone, before = lab_field.drones["drone_1"], Figures(lab_field, tuple(lab_field.drones))
    std = LensStd(fx_px=9.2, fy_px=4.6, cx_px=1.0, cy_px=1.0, k1=0.01, k2=0.01, p1=0.0, p2=0.0, k3=0.0)
    lens = msgspec.structs.replace(drone.camera.calibration, fx_px=460.0, fy_px=460.0, std=std)
    camera = msgspec.structs.replace(drone.camera, calibration=lens, attitude_std_deg=2.0, position_std_m=0.03)
    drones = {**lab_field.drones, "drone_1": msgspec.structs.replace(drone, camera=camera)}
    after = Figures(msgspec.structs.replace(lab_field, drones=drones), tuple(drones))
    changed = {key: after.surveyed[at] for key, at in after.place.items() if after.surveyed[at] != before.surveyed[at]}
    assert changed == pytest.approx(
        {("drone_1", part): 0.03 for part in ("ahead", "left", "up")}
        | {("drone_1", part): math.radians(2.0) for part in ("pan", "tilt")}
        | {("drone_1", "focal"): 0.02}
    )
