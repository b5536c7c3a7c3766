"""The operator's warning of sightings that show a robot turned that has not turned itself."""

from groundstation.bus.messages import Severity, Verdict
from groundstation.estimation.event_log import TURNED
from groundstation.estimation.measurement import Correction
from groundstation.runtime.turned_watch import TurnedWatch

MS = 1_000_000


def turned(subject: str = "drone_1") -> Correction:
    return Correction("mocap", subject, Verdict.INFLATED, TURNED, nis=1.0)


def test_a_body_that_stays_turned_is_told_once_with_its_observer_and_so_is_its_return() -> None:
    watch, told = TurnedWatch(), []
    for k in range(100):
        told += [(k, notice) for notice in watch.take([turned()], 33 * k * MS)]
    ((k, notice),) = told
    assert 0.4 < 0.033 * k < 0.7 and notice.severity is Severity.WARNING and notice.entity == "drone_1"
    assert notice.text.startswith("mocap sees it turned")
    fine = Correction("mocap", "drone_1", Verdict.ACCEPTED)
    after = [notice for k in range(100, 200) for notice in watch.take([fine], 33 * k * MS)]
    assert [(n.severity, n.text) for n in after] == [(Severity.INFO, "mocap no longer sees it turned")]


def test_single_misread_markers_are_no_news() -> None:
    watch = TurnedWatch()
    assert [notice for k in range(20) for notice in watch.take([turned()], 1500 * k * MS)] == []
