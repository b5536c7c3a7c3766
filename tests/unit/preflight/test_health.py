"""What pre-flight says of each camera's pictures."""

import pytest

from groundstation.bus.messages import CameraStatus, Header
from groundstation.doctor.finding import Finding, Level
from groundstation.field.resolved import ResolvedField
from groundstation.preflight.health import camera_findings


def findings(field: ResolvedField, **picture: float) -> list[Finding]:
    header = Header(0, "c", "ceiling", "ceiling", 1)
    status = CameraStatus(
        header=header, connected=True, fps=15.0, age_ms=130.0, frames=99, skipped=0, detections=42,
        brightness=picture.get("brightness"), edge_px=picture.get("edge_px"),
    )  # fmt: skip
    found = camera_findings(field, {"ceiling": status}, {"ceiling": ["drone_1", "drone_2"]})
    return [one for one in found if one.subject == "ceiling"]


def test_a_good_picture_is_one_line_with_rate_age_and_whose_markers_are_seen(lab_field: ResolvedField) -> None:
    (one,) = findings(lab_field, brightness=0.49, edge_px=2.1)
    assert one.level is Level.OK
    assert one.found == "15 pictures/s, 130 ms old, 42 sightings, sees drone_1, drone_2"


@pytest.mark.parametrize(
    ("picture", "words"),
    [
        ({"brightness": 0.03, "edge_px": 2.5}, "too dark (mean 3% of white)"),
        ({"brightness": 0.96}, "too bright (mean 96% of white)"),
        ({"brightness": 0.5, "edge_px": 8.2}, "blurred: the sharpest edges are 8 pixels wide"),
    ],
)
def test_a_bad_picture_is_named_with_its_remedy(
    lab_field: ResolvedField, picture: dict[str, float], words: str
) -> None:
    _, worse = findings(lab_field, **picture)
    assert worse.level is Level.SHOULD and words in worse.found and worse.remedy
