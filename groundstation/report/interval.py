"""The part of a run that counts: from the first drone that may track to the command that ends it."""

from groundstation.bus.messages import AckStage, Verb
from groundstation.report.tracks import RunData

_STARTED = (AckStage.ACCEPTED, AckStage.EFFECTIVE)


def tracking_interval(data: RunData) -> tuple[float, float] | None:
    """Return (start, end) [s], or None when no drone ever accepted TRACK.

    It ends with the LAND or CUT_MOTORS of the whole team, or else with the last message.
    """
    starts = [ack.time_s for ack in data.acks if ack.message.verb is Verb.TRACK and ack.message.stage in _STARTED]
    if not starts:
        return None
    start = min(starts)
    team = set(data.drones)
    for command in data.commands:
        scope = set(command.message.scope)
        ends = command.message.verb in (Verb.LAND, Verb.CUT_MOTORS) and (not scope or (bool(team) and scope >= team))
        if ends and command.time_s >= start:
            return start, command.time_s
    return start, max(start, data.end_s)
