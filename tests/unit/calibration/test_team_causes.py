"""As few causes as explain it: from information and pull to what is wrong."""

import numpy as np

from groundstation.calibration.team_causes import causes, freed, posterior
from groundstation.calibration.team_figures import Figures, Suspicion
from groundstation.field.resolved import ResolvedField

SURVEYED = np.array([0.01, 0.01, 0.01])


def suspicions() -> list[Suspicion]:
    single = [Suspicion(name, "size", np.eye(3)[:, [i]], np.array([0.5])) for i, name in enumerate("abc")]
    return [*single, Suspicion("", "size", np.ones((3, 1)), np.array([0.5]))]


def test_what_is_within_its_survey_has_no_cause() -> None:
    H = np.diag([1e6, 1e6, 1e6])
    found, sigma = causes(H, H @ np.array([0.01, -0.01, 0.005]), SURVEYED, suspicions())
    assert found == () and not freed(found).any()
    assert np.allclose(np.diag(sigma), SURVEYED**2)


def test_one_figure_and_all_alike_are_told_apart() -> None:
    H = np.diag([1e5, 1e5, 1e5])
    for errors, who in (([0.0, 0.2, 0.0], "b"), ([0.2, 0.2, 0.2], "")):
        found, sigma = causes(H, H @ np.array(errors), SURVEYED, suspicions())
        assert [one.suspicion.who for one in found] == [who]
        mean, covariance = posterior(H, H @ np.array(errors), sigma)
        assert np.allclose(mean, errors, atol=3.0 * np.sqrt(np.diag(covariance)).max())


def test_causes_that_explain_it_as_well_are_rivals() -> None:
    direction = np.array([1.0, 1.0, 0.0])
    H = 1e5 * np.outer(direction, direction)
    found, _ = causes(H, H @ np.array([0.2, 0.0, 0.0]), SURVEYED, suspicions()[:3])
    assert found[0].suspicion.who in "ab" and {one.who for one in found[0].rivals} == {"a", "b"} - {
        found[0].suspicion.who
    }


def test_every_figure_of_the_lab_has_a_survey_and_a_suspicion(lab_field: ResolvedField) -> None:
    figures = Figures(lab_field, tuple(lab_field.drones))
    covered = sum(np.any(s.directions != 0.0, axis=1) for s in figures.suspicions())
    assert (
        (np.asarray(covered) >= 1).all() and (figures.surveyed > 0.0).all() and (figures.wide >= figures.surveyed).all()
    )
