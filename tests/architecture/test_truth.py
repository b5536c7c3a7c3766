"""Ground truth serves judgement and display of a run only: estimation, planning and control never name it."""

import ast
from pathlib import Path

from groundstation.bus.topics import Plane
from groundstation.runtime import inbox

ROOT = Path(__file__).parents[2]
MAY_NAME_IT = (
    "groundstation/bus",
    "groundstation/report",
    "groundstation/console",
    "groundstation/bench",
    "groundstation/experiments",
    "groundstation/engineering_views",
    "groundstation/recording/synthetic.py",
    "groundstation/replay/playback_server.py",
)


def names_of(path: Path) -> set[str]:
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path)))
    found = {node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "") for node in nodes}
    return found & {"TRUTH", "TruthState"}


def test_only_what_judges_or_shows_a_run_names_the_truth() -> None:
    sources = [path for package in ("groundstation", "drivers") for path in (ROOT / package).rglob("*.py")]
    places = [str(path.relative_to(ROOT)) for path in sources if names_of(path)]
    assert places, "it is named somewhere"
    assert [place for place in places if not place.startswith(MAY_NAME_IT)] == []


def test_the_tracker_hears_production_topics_only() -> None:
    assert {topic.plane for topic in inbox.TOPICS} == {Plane.PRODUCTION}
