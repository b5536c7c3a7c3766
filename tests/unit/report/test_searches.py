"""Searches in the report: their times, and the maps that show their places."""

from pathlib import Path

from groundstation.bus import messages as m
from groundstation.report.judge import judge
from groundstation.report.page.document import write_page
from groundstation.report.run_facts import RunFacts
from groundstation.report.searches import searches
from groundstation.report.tracks import UNKNOWN_FIELD, RunData, TimedMessage

HEADER = m.Header(0, "here", "turtlebot", "tracker", 0)


def seen(time_s: float) -> TimedMessage[m.SearchMap]:
    chances = (0, 255, 40, 0, 10, 0)
    return TimedMessage(time_s, m.SearchMap(header=HEADER, first_m=(-0.5, 0.0), cell_m=0.5, columns=3, chances=chances))


def test_maps_without_a_pause_are_one_search() -> None:
    maps = {"turtlebot": [seen(t) for t in (10.0, 10.5, 11.0, 11.5, 30.0)], "other": [seen(20.0), seen(20.5)]}
    found = [(one.target, one.begin_s, one.end_s, [shown.time_s for shown in one.maps]) for one in searches(maps)]
    assert found == [
        ("turtlebot", 10.0, 11.5, [10.0, 11.0, 11.5]),
        ("other", 20.0, 20.5, [20.0, 20.5]),
        ("turtlebot", 30.0, 30.0, [30.0]),
    ]


def test_only_the_longest_are_shown() -> None:
    maps = [seen(time_s) for time_s in (0.0, 1.0, 10.0, 20.0, 20.5, 30.0, 31.0)]
    assert [one.begin_s for one in searches({"turtlebot": maps})] == [0.0, 20.0, 30.0]


def test_the_page_shows_them_and_says_nothing_of_a_flight_without(tmp_path: Path) -> None:
    data = RunData(UNKNOWN_FIELD, RunFacts(), end_s=40.0)
    write_page(data, judge(data, tmp_path), tmp_path / "calm.html")
    assert "Searches" not in (tmp_path / "calm.html").read_text()
    data.search_maps["turtlebot"] = [seen(12.0), seen(12.5)]
    write_page(data, judge(data, tmp_path), tmp_path / "lost.html")
    page = (tmp_path / "lost.html").read_text()
    assert "turtlebot was searched for from 12.0 s to 12.5 s" in page and page.count("<svg") == 2
