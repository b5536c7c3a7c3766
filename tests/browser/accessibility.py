"""Runs axe-core, the accessibility checker, on a page."""

import os
from pathlib import Path
from typing import Any

import pytest

AXE = Path(__file__).parents[2] / ".interop" / "node" / "node_modules" / "axe-core" / "axe.min.js"
# Curves are drawn on canvases; axe judges the document.
RUN = """async () => (await axe.run(document, {resultTypes: ["violations"]})).violations.flatMap((rule) =>
    rule.nodes.map((node) => `${rule.id}: ${node.target.join(" ")}: ${node.failureSummary}`))"""


def violations(page: Any) -> list[str]:
    """Return axe's findings, one line for each element; skips where axe is not installed, and fails there in CI."""
    if not AXE.is_file():
        assert not os.environ.get("CI"), f"{AXE} is missing: make interop"
        pytest.skip("axe-core is not installed: make interop")
    # Evaluated by the debugger: the page's own content security policy stays as it is.
    page.evaluate(AXE.read_text())
    return list(page.evaluate(RUN))
