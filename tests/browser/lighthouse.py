"""Runs Lighthouse and returns the accessibility audits that a page fails."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

LIGHTHOUSE = Path(__file__).parents[2] / ".interop" / "node" / "node_modules" / "lighthouse" / "cli" / "index.js"
OPTIONS = (
    "--only-categories=accessibility",
    "--preset=desktop",
    "--disable-storage-reset",  # the wall view is a choice that the browser remembers
    "--max-wait-for-load=15000",  # a page that receives 20 messages a second is never idle
    "--no-enable-error-reporting",
    "--output=json",
    "--quiet",
)


def accessibility(url: str, browser_port: int) -> tuple[float, list[str]]:
    """Return the score [0, 1] and the titles of failed audits, of a page in the Chromium that has this debugging port.

    Skips where Lighthouse is not installed, and fails there in CI.
    """
    if not LIGHTHOUSE.is_file() or not shutil.which("node"):
        assert not os.environ.get("CI"), f"{LIGHTHOUSE} or node is missing: make interop"
        pytest.skip("lighthouse is not installed: make interop")
    command = ["node", str(LIGHTHOUSE), url, f"--port={browser_port}", *OPTIONS]
    done = subprocess.run(command, capture_output=True, text=True, timeout=180)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    failed = [audit["title"] for audit in report["audits"].values() if audit["score"] not in (1, None)]
    return float(report["categories"]["accessibility"]["score"]), failed
