"""Runs modules of the page in node, with a stand-in for the part of a browser that they use."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

_JS = Path(__file__).parents[3] / "groundstation" / "console" / "static" / "js"
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")

# The part of a browser that these modules use.
_BROWSER = """
const spoken = [], played = [];
const quiet = { getItem: () => null, setItem: () => {} };
Object.assign(globalThis, {
  window: globalThis, localStorage: quiet, sessionStorage: quiet,
  document: { querySelector: () => ({ content: "" }), getElementById: () => ({ setAttribute() {} }) },
  SpeechSynthesisUtterance: class { constructor(words) { this.words = words; } },
  speechSynthesis: {
    cancel: () => played.push("cut off"),
    speak: ({ words }) => { spoken.push(words); played.push(words); },
  },
});
globalThis.navigator ??= {};
const beginning = performance.now();
let passedMs = 0;
performance.now = () => beginning + passedMs;
const wait = (ms) => { passedMs += ms; };
const { store } = await import("./store.js");
store.scene = { drones: [{ name: "drone_1" }, { name: "drone_2" }], targets: [], lost_after_s: 3, unseen_land_s: 30 };
Object.assign(store, { connected: true, receivedAt: Infinity });
const heard = (charges) => Object.fromEntries(Object.entries(charges).map(([name, [battery, charge]]) =>
  [name, { battery, charge, minutes: null, good_for: "", battery_min: 0.15 }]));
"""

LINK = """
const sent = (kind) => sockets[0].sent.filter(({ type }) => type === kind), sockets = [];
globalThis.location = { protocol: "http:", host: "127.0.0.1" };
globalThis.Element = class {};
globalThis.WebSocket = class {
  static OPEN = 1;
  readyState = 1;
  sent = [];
  constructor() { sockets.push(this); }
  send(text) { this.sent.push(JSON.parse(text)); }
};
const { connect } = await import("./link.js");
connect();
const hear = (message) => sockets.at(-1).onmessage({ data: JSON.stringify(message) });
const welcome = (more) => ({ type: "welcome", name: "viewer 1", trusted: true, role: "command", ...more });
const seed = (seq, more) => ({ type: "seed", seq, now: 0, run: "", scene: store.scene, s: {},
  history: { trails: {}, samples: [] }, ...more });
"""


def run_in_node(folder: Path, script: str) -> Any:
    """Return the `result` of a script that uses the page's modules, which are copied to a new folder."""
    shutil.copytree(_JS, folder)
    (folder / "package.json").write_text('{"type": "module"}')
    ending = "console.log(JSON.stringify(result)); process.exit(0);"
    (folder / "try.js").write_text(f"{_BROWSER}\n{script}\n{ending}")
    ran = subprocess.run(["node", "try.js"], cwd=folder, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)
