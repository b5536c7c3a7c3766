"""Words for what failsafes do with a vehicle: what it does and why, and whether an operator must act. Pure."""

from typing import NamedTuple

from groundstation.bus.messages import AIRBORNE, NOT_DOWN, VehicleStatus

# As drivers end the reason for a hover that only an order ends.
_NEEDED = "; RESUME is needed"
_UNCUT, _STANDS, _OUTSIDE = "cut_ignored", "stands_running", "outside"
_RESUME = "To do: press RESUME, or HOLD to keep it there"

_STAY_AWAY = "To do: stay away until it is down, it is told to land; CUT MOTORS tries to stop its motors again."
_CUT = "To do: stay away; press CUT MOTORS, or the kill switch of its transmitter: it falls then."
_STOP = "To do: stay away; press CUT MOTORS, or the kill switch of its transmitter."


class FailsafeWords(NamedTuple):
    """An alarm's words without its vehicle's name, which comes first; `grave` and `advice` as in an alarm."""

    about: str
    text: str
    grave: bool
    advice: str


def will_land(status: VehicleStatus) -> bool:
    """Return whether a flying drone that nobody sees lands for that, for all that its driver says."""
    return status.flight_state in AIRBORNE and status.lands_in_s is None and status.failsafe not in NOT_DOWN


def failsafe_words(status: VehicleStatus) -> FailsafeWords | None:
    """Return the words for a condition that keeps a drone from its plan, or will land it; None: there is none."""
    if status.failsafe == _UNCUT or (status.mode == "CUT" and status.lands_in_s is not None):
        return FailsafeWords("uncut", "flies although its motors were cut", True, _STAY_AWAY)
    if status.failsafe in NOT_DOWN:
        advice = _STOP if status.failsafe == _STANDS else _CUT
        return FailsafeWords("not down", status.detail.removeprefix("it "), True, advice)
    why, lands_in_s = status.detail.removeprefix("hovers: ").removesuffix(_NEEDED), status.lands_in_s
    soon = "" if lands_in_s is None else f"starts to land in {max(1, round(lands_in_s))} s"
    if status.detail.endswith(_NEEDED):
        text = f"{soon}: {why}" if soon else f"hovers: {why}"
        return FailsafeWords("waits", text, True, f"{_RESUME}; otherwise it lands by itself.")
    if soon:
        advice = "Nothing to do: it lands by itself unless this ends. HOLD does not stop it."
        if status.failsafe == _OUTSIDE:
            advice = "To do: press RESUME: the tracker leads it back; otherwise it lands by itself."
        return FailsafeWords("lands", f"{soon}: {why}", True, advice)
    if status.braked:
        return FailsafeWords("braked", status.detail, False, "Nothing to do: it follows its plan again when this ends.")
    return None
