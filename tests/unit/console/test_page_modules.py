"""Page modules that need no browser, run by node: battery texts in the bar and in speech."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

_JS = Path(__file__).parents[3] / "groundstation" / "console" / "static" / "js"
pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")

# The part of a browser that these modules use.
_BROWSER = """
const spoken = [];
const quiet = { getItem: () => null, setItem: () => {} };
Object.assign(globalThis, {
  window: globalThis, localStorage: quiet, sessionStorage: quiet,
  document: { querySelector: () => ({ content: "" }), getElementById: () => ({ setAttribute() {} }) },
  SpeechSynthesisUtterance: class { constructor(words) { this.words = words; } },
  speechSynthesis: { cancel() {}, speak: ({ words }) => spoken.push(words) },
});
globalThis.navigator ??= {};
const { store } = await import("./store.js");
store.scene = { drones: [{ name: "drone_1" }, { name: "drone_2" }], targets: [], lost_after_s: 3 };
const heard = (charges) => Object.fromEntries(Object.entries(charges).map(([name, [battery, charge]]) =>
  [name, { battery, charge, minutes: null, good_for: "", battery_min: 0.15 }]));
"""


@pytest.fixture
def said(tmp_path: Path) -> Any:
    """Return a function that runs a script with the page's modules, and returns its `result`."""
    folder = tmp_path / "js"
    shutil.copytree(_JS, folder)
    (folder / "package.json").write_text('{"type": "module"}')

    def run(script: str) -> Any:
        ending = "console.log(JSON.stringify(result)); process.exit(0);"
        (folder / "try.js").write_text(f"{_BROWSER}\n{script}\n{ending}")
        ran = subprocess.run(["node", "try.js"], cwd=folder, capture_output=True, text=True, timeout=60)
        assert ran.returncode == 0, ran.stderr
        return json.loads(ran.stdout)

    return run


def test_the_worst_battery_is_told_though_another_drone_was_never_heard(said: Any) -> None:
    script = """
    const { worstBattery } = await import("./batteries.js");
    const result = [worstBattery()];
    store.s.vehicles = heard({ drone_1: [0.18, "empty"] });
    result.push(worstBattery());
    """
    nothing, worst = said(script)
    assert nothing is None
    assert (worst["name"], worst["words"], worst["level"]) == ("drone_1", "18 %", "bad")


def test_each_battery_that_runs_low_is_heard_whatever_is_known_of_the_others(said: Any) -> None:
    script = """
    const { listen } = await import("./sounds.js");
    const flown = [{ drone_2: [null, "unknown"] }, { drone_1: [0.6, "good"], drone_2: [null, "unknown"] },
      { drone_1: [0.28, "low"], drone_2: [null, "unknown"] }, { drone_1: [0.28, "low"], drone_2: [0.19, "empty"] },
      { drone_1: [0.19, "empty"], drone_2: [0.19, "empty"] }];
    for (const charges of flown) { store.s.vehicles = heard(charges); listen(); }
    const result = spoken;
    """
    assert said(script) == ["battery drone_1 low", "battery drone_2 empty", "battery drone_1 empty"]
