"""Heights that a field file leaves to its room and targets."""

import itertools
from pathlib import Path

import pytest

from groundstation.errors import SettingsError
from groundstation.settings.level_heights import derived_heights
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field, yaml_of
from groundstation.settings.schema import Field

LAB = Path(__file__).parents[2] / "fixtures" / "field" / "lab.yaml"
LEFT_OUT = "planner.level_heights_m=[]"


@pytest.mark.parametrize("fence_top_m", [1.3, 1.5, 2.0, 2.8, 6.3, 18.0])
@pytest.mark.parametrize("target_m", [0.0, 0.2, 0.4])
@pytest.mark.parametrize("team", [1, 2, 3, 10])
def test_the_heights_lie_over_the_target_below_the_fence_and_within_the_cameras_range(
    fence_top_m: float, target_m: float, team: int
) -> None:
    rows = derived_heights(fence_top_m, target_m, 1.9, team)
    assert [len(row) for row in rows] == list(range(1, len(rows) + 1)) and 1 <= len(rows) <= team
    for row in rows:
        assert all(upper - lower >= 0.39 for upper, lower in itertools.pairwise(row))
        assert target_m + 0.4 <= row[-1] < target_m + 1.9 and row[0] <= fence_top_m - 0.3


def test_a_field_without_heights_has_those_of_its_room_everywhere() -> None:
    field = load_field(LAB, [LEFT_OUT])
    assert field.planner.level_heights_m == ((1.57,), (1.8, 1.1))
    assert resolved_field(field).planner.level_heights_m == field.planner.level_heights_m
    assert Field.model_validate_json(field.model_dump_json()) == field
    assert "level_heights_m: - [1.57] - [1.8, 1.1]" in " ".join(yaml_of(field).split())


def test_given_heights_are_kept() -> None:
    assert load_field(LAB, ["planner.level_heights_m=[[1.4],[1.9,1.0]]"]).planner.level_heights_m[0] == (1.4,)


def test_a_fence_too_low_to_fly_over_the_target_is_refused() -> None:
    with pytest.raises(SettingsError, match=r"room\.fence\.z_m: must reach 1\.1 m .* over the target \(got 1\)"):
        load_field(LAB, [LEFT_OUT, "room.fence.z_m=[0.0, 1.0]"])
