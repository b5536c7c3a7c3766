"""Words and units of figures and criteria, shared by terminal, page and comparison."""

from groundstation.appearance.topology import NOBODY, topology_words
from groundstation.report.criteria import Criterion, Value
from groundstation.report.topology_use import FLAT, NONE, OTHER, STRING

_BOUNDS = {"<=": "at most", "<": "below", ">=": "at least", ">": "more than"}
# Name of a figure in report.json: its title and its unit.
_TITLES = {
    "target_rmse_m": ("target error (rms)", "m"),
    "target_lost_s": ("target lost", "s"),
    "target_found_s": ("target found after", "s"),
    "target_kept_rmse_m": ("target error (rms) while it was not lost", "m"),
    "target_judged": ("share of the time with a truth of the target", ""),
    "target_unseen_s": ("target unseen, by the estimates", "s"),
    "drone_uncertain_s": ("longest time with a drone's place unknown", "s"),
    "max_fence_violation_m": ("beyond the fence", "m"),
    "min_obstacle_m": ("least distance from an obstacle", "m"),
    "min_separation_m": ("least separation", "m"),
    "drones_judged": ("share of a drone's flight with a truth", ""),
    "landed": ("everybody landed", ""),
    "cuts_in_flight": ("drones that fell with their motors cut", ""),
    "tracked_s": ("time tracked", "s"),
    "field_read": ("its field could be read", ""),
    "recorded_share": ("share of the flight that is recorded", ""),
    "command_to_airborne_s": ("from the command to the air", "s"),
    "failsafe_landings": ("flights ended by a failsafe", ""),
    "planner_p50_ms": ("planning step, median", "ms"),
    "unplanned_s": ("longest time without a plan, while tracking", "s"),
    "planner_p99_ms": ("planning step, 99th percentile", "ms"),
    "tracker_missed_percent": ("tracker's deadlines missed", "%"),
    "tracker_rate_hz": ("tracker's rate", "Hz"),
    "mean_cpu_cores": ("processor used", "cores"),
    "sim_overrun_percent": ("simulator's ticks or pictures late", "%"),
    "starved_s": ("kept from the processor by other programs", "s"),
    "topology_switches": ("switches of topology", ""),
}
KIND_WORDS = {
    FLAT: "all drones on one level",
    STRING: "each drone on a level of its own",
    OTHER: "another topology",
    NONE: NOBODY,
}
"""Names of the kinds of topologies."""
_SECONDS_OF = "topology_seconds."


def title(name: str) -> str:
    """Return the title of a figure of report.json; its name if it has no title."""
    topology = name.removeprefix(_SECONDS_OF)
    if topology != name:
        return f"time with {KIND_WORDS.get(topology) or topology_words(topology)}"
    return _TITLES.get(name, (name, ""))[0]


def unit(name: str) -> str:
    """Return the unit of a figure, "" if it has none."""
    return "s" if name.startswith(_SECONDS_OF) else _TITLES.get(name, (name, ""))[1]


def quantity(name: str, value: Value) -> str:
    """Return a value with its unit, at most three decimals."""
    if value is None:
        return "not measured"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.3f}".rstrip("0").rstrip(".") + (f" {unit(name)}" if unit(name) else "")


def bound(criterion: Criterion) -> str:
    """Return a criterion's limit in words ("at most 0.2 m", "0", "yes"), with its source if it is not the usual one."""
    limit = quantity(criterion.name, criterion.limit)
    return f"{_BOUNDS.get(criterion.relation, '')} {limit}{f' by {criterion.by}' if criterion.by else ''}".strip()


def missed(criterion: Criterion) -> str:
    """Return the reason for a missed criterion, as part of a sentence."""
    found = f"{title(criterion.name)} {quantity(criterion.name, criterion.value)}, asked for {bound(criterion)}"
    return f"{found} ({criterion.why})" if criterion.why else found
