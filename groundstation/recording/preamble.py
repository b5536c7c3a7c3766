"""The head of every file of a run, which makes each part understandable alone."""

import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import msgspec

from groundstation.bus import clock
from groundstation.field.resolved import field_from_json
from groundstation.process.numba_cache import sources_hash
from groundstation.recording.compatibility import MESSAGE_VERSION, VERSION_FIELD
from groundstation.recording.timeline import Timeline

FIELD_NAME = "field.json"
CALIBRATIONS_NAME = "calibrations.json"
COMMAND_NAME = "run.json"  # how the run was started, and when
_LIBRARIES = ("skein-groundstation", "mcap", "msgspec", "numpy", "numba", "scipy", "opencv-python-headless")
# Written into the run folder before the recorder starts, where there is one.
_FILES = {"resolved.yaml": "application/yaml", COMMAND_NAME: "application/json"}
_CONVENTIONS = {
    "world": "z up, origin on the floor in the middle of the room, metres",
    "base": "FLU; yaw counter-clockwise, radians",
    "log_time": "UNIX ns of the measurement: header.stamp_ns of clock `run.clock` + run.unix_offset_ns",
    "ellipses": "95 %",
}


@dataclass(frozen=True, slots=True)
class Preamble:
    """Metadata records, and attachments as (media type, bytes)."""

    metadata: Mapping[str, Mapping[str, str]]
    attachments: Mapping[str, tuple[str, bytes]]
    created_unix_ns: int


def preamble_of_run(field: bytes, epoch: int, timeline: Timeline, folder: Path) -> Preamble:
    """Return the preamble for a resolved field (JSON) and the contents of the run folder."""
    created = clock.now_ns() + timeline.unix_offset_ns
    resolved = field_from_json(field)
    run = {
        "site": resolved.site,
        "epoch": str(epoch),
        "clock": timeline.clock,
        "unix_offset_ns": str(timeline.unix_offset_ns),
        "created_unix_ns": str(created),
        VERSION_FIELD: str(MESSAGE_VERSION),
    }
    versions = {name: version(name) for name in (*_LIBRARIES, "eclipse-zenoh")} | {"python": platform.python_version()}
    # A re-run repeats every bit only with the same compiled kernels on the same kind of processor.
    versions |= {"kernels": sources_hash(), "processor": processor()}
    attachments = {FIELD_NAME: ("application/json", field)}
    attachments[CALIBRATIONS_NAME] = ("application/json", msgspec.json.encode(resolved.calibrations))
    for name, media_type in _FILES.items():
        if (folder / name).is_file():
            attachments[name] = (media_type, (folder / name).read_bytes())
    metadata = {"run": run, "versions": versions, "seeds": _seeds(attachments), "conventions": _CONVENTIONS}
    return Preamble(metadata, attachments, created)


def processor() -> str:
    """Return the name of this host's processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _seeds(attachments: Mapping[str, tuple[str, bytes]]) -> dict[str, str]:
    """Return the seeds of a simulated run; empty for a real flight."""
    _, text = attachments.get(COMMAND_NAME, ("", b"{}"))
    try:
        facts = json.loads(text)
    except ValueError:
        return {}
    return {name: str(facts[name]) for name in ("scenario", "seed") if facts.get(name) is not None}
