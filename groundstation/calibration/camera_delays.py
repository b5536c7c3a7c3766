"""Delays of cameras on vehicles, found with the filter: each is judged by the sightings of all cameras."""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

from groundstation.bus.messages import RelativeObservation
from groundstation.calibration.flown import Flown
from groundstation.calibration.likeliest import likeliest
from groundstation.calibration.recorded_likelihood import costs
from groundstation.calibration.sensor_delay import LEAST_SEEN, Delay
from groundstation.field.resolved import ResolvedField

_ROUNDS = 2
# A camera's delay is found anew when others have since changed by more than this: a third of it enters the first's.
_SETTLED_MS = 5.0
_TARGET_ONLY = "doubtful: it saw hardly any other drone, and how the target moves nobody knows"
_WATCH = "turn and move while it sees another drone"


def onboard_cameras(flown: Flown, resolved: ResolvedField, fixed: Mapping[str, Delay]) -> list[Delay]:
    """Return the delays of the cameras on vehicles, found in turn, and again where others have changed since.

    fixed: delays of the fixed cameras. An equal delay of all cameras hardly affects the filter, so these delays can be
    no better known than those of the fixed cameras.
    """
    found = dict(fixed)
    assumed: dict[str, dict[str, float]] = {}
    common_ms = max((one.std_ms or 0.0 for one in fixed.values() if one.sure), default=0.0)
    for _ in range(_ROUNDS):
        for drone in resolved.drones:
            later_ms = {name: _later_ms(one) for name, one in found.items() if name != drone}
            if drone in assumed and _much_alike(assumed[drone], later_ms):
                continue
            assumed[drone] = later_ms
            found[drone] = _onboard(flown, resolved, drone, later_ms, common_ms)
    return [found[drone] for drone in resolved.drones]


def _later_ms(delay: Delay) -> float:
    """Return a camera's delay beyond its setting [ms]; 0 if it is uncertain."""
    return (delay.measured_ms or delay.now_ms) - delay.now_ms if delay.sure else 0.0


def _much_alike(before: Mapping[str, float], after: Mapping[str, float]) -> bool:
    return all(abs(later_ms - before.get(name, 0.0)) <= _SETTLED_MS for name, later_ms in after.items())


def _onboard(
    flown: Flown, resolved: ResolvedField, drone: str, others_ms: Mapping[str, float], common_ms: float
) -> Delay:
    now_ms = resolved.drones[drone].camera.video_delay_ms
    none = Delay(f"{drone} camera", f"drones.{drone}.camera.video_delay_ms", now_ms, flight=_WATCH)
    seen = _seen(flown, drone)
    if seen.total() < LEAST_SEEN:
        return replace(none, reason="it saw too little")
    found = likeliest(lambda later_ms: costs(flown, resolved, {**others_ms, drone: later_ms}))
    if found is None:
        return replace(none, reason="no delay within 100 ms of the setting fits")
    if not math.isfinite(found.std_ms):
        return replace(none, reason="the recording does not show it")
    doubt = "" if sum(seen[name] for name in resolved.drones) >= LEAST_SEEN else _TARGET_ONLY
    std_ms = math.hypot(found.std_ms, common_ms)
    return replace(none, measured_ms=now_ms + found.later_ms, std_ms=std_ms, reason=doubt)


def _seen(flown: Flown, observer: str) -> Counter[str]:
    """Return how often an observer saw each subject."""
    messages = (message for _, inputs in flown.ticks for _, message in inputs)
    return Counter(m.subject for m in messages if isinstance(m, RelativeObservation) and m.observer == observer)
