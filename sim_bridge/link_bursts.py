"""Draws random losses of links as faults, so that all faults are in one table."""

from collections.abc import Iterable

from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.scenario import Scenario
from sim_bridge.world.noise import generator_of

_HORIZON_S = 900.0


def with_bursts(scenario: Scenario, drones: Iterable[str], cameras: Iterable[str], seed: int) -> Scenario:
    """Return a scenario whose faults include its link bursts of the first 15 minutes.

    cameras: the drones whose pictures come over the same radio; each vehicle's bursts are its own.
    """
    bursts, carried = scenario.link_bursts, frozenset(cameras)
    if bursts.per_minute <= 0.0:
        return scenario
    faults = list(scenario.faults)
    for name in drones:
        rng = generator_of(seed, f"{name}/link")
        kinds = [FaultKind.NAVDATA_SILENT, FaultKind.AT_DEAF]
        kinds += [FaultKind.CAMERA_STALL] if name in carried else []
        start_s = bursts.from_s
        while (start_s := start_s + float(rng.exponential(60.0 / bursts.per_minute))) < _HORIZON_S:
            end_s = start_s + float(rng.uniform(*bursts.length_s))
            faults += [Fault(kind=kind, entity=name, start_s=start_s, end_s=end_s) for kind in kinds]
            start_s = end_s
    return scenario.model_copy(update={"faults": tuple(faults)})
