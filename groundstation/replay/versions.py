"""The libraries that affect the last bit, compared with the recorded ones."""

from collections.abc import Mapping
from importlib.metadata import version

from groundstation.process.numba_cache import sources_hash
from groundstation.recording.preamble import processor

# Kernels are compiled by these; another version of one of them may round differently.
DECIDING = ("numpy", "numba", "scipy")
KERNELS, PROCESSOR = "kernels", "processor"


def current() -> dict[str, str]:
    """Return the libraries of a re-run, in the recorder's form."""
    return {name: version(name) for name in DECIDING} | {KERNELS: sources_hash(), PROCESSOR: processor()}


def foreign(recorded: Mapping[str, str]) -> list[str]:
    """Return a line for each library, or for the kernels' sources, where it differs from the recording."""
    lines = []
    for name in DECIDING:
        then, now = recorded.get(name), version(name)
        if then is None:
            lines.append(f"{name} {now} now; which one was used then is not recorded")
        elif then != now:
            lines.append(f"{name} {then} then, {now} now")
    then = recorded.get(KERNELS)
    if then is not None and then != sources_hash():
        lines.append("the compiled parts of estimator and planner have changed since")
    if recorded.get(PROCESSOR) not in (None, processor()):
        lines.append(f"{recorded[PROCESSOR]} then, {processor()} now")
    return lines
