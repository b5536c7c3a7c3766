"""The report page opened from its file: charts, shared zoom, no network requests."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from accessibility import violations

from groundstation.bus import messages as m
from groundstation.report.judge import judge
from groundstation.report.page.document import write_page
from groundstation.report.run_facts import RunFacts
from groundstation.report.tracks import UNKNOWN_FIELD, EstimateTrack, RunData, TimedMessage, TruthTrack

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def recorded() -> RunData:
    time_s = np.arange(0.0, 20.0, 0.1)
    position = np.column_stack([np.sin(time_s), np.cos(time_s), np.zeros_like(time_s)])
    truth = TruthTrack(time_s, position, np.zeros_like(time_s), np.ones_like(time_s) > 0)
    covariance = np.array([np.eye(2) * 0.01] * len(time_s))
    estimate = EstimateTrack("target", time_s, position[:, :2] + 0.05, covariance)
    header = m.Header(0, "here", "team", "tracker", 0)
    solver = m.SolverReport("ok", 1, 0.001, 2, 1)
    plans = [
        TimedMessage(float(at), m.Plan(header=header, topology="a,b" if at < 10 else "a/b",
                                cost=0.1 + 0.01 * math.sin(at), controls=(), edges=(), alternatives=(), solver=solver,
                                mode="x"))
        for at in time_s
    ]  # fmt: skip
    return RunData(
        UNKNOWN_FIELD,
        RunFacts(),
        end_s=20.0,
        truth={"turtlebot": truth},
        estimates={"turtlebot": estimate},
        plans=plans,
    )


def test_page_draws_its_charts_from_the_file_alone(browser: Any, tmp_path: Path) -> None:
    data = recorded()
    write_page(data, judge(data, tmp_path), tmp_path / "report.html")
    page = browser.new_page(viewport={"width": 390, "height": 800})
    troubles: list[str] = []
    requests: list[str] = []
    page.on("console", lambda message: troubles.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.goto((tmp_path / "report.html").as_uri())
    page.wait_for_function("window.__report && window.__report.charts >= 3")
    assert not troubles
    assert requests == [(tmp_path / "report.html").as_uri()]
    painted = """() => [...document.querySelectorAll("canvas")].map((c) => {
      const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
      return d.some((value) => value !== 0);
    })"""
    assert all(page.evaluate(painted))
    assert page.evaluate("document.documentElement.scrollWidth") <= 390  # nothing exceeds a phone's screen
    page.screenshot(path=tmp_path / "phone.png")
    found = violations(page)
    assert not found, "\n".join(found)
    page.close()
