"""Is one figure of the field wrong? The operator reads which, by how much, and what to do; no action follows."""

import math

from groundstation.bus.messages import RelativeObservation, Severity
from groundstation.bus.notice import Notice
from groundstation.estimation.attitude_intake import Lean
from groundstation.estimation.figure_suspicion import Charge, FigureSuspicion, Suspect
from groundstation.estimation.sight_loops import SightLoops
from groundstation.field.resolved import ResolvedField
from groundstation.time_units import NS_PER_S

_MOST_TOLD = 3
_SETTINGS = {"pan": "pan_left_deg", "tilt": "tilt_down_deg"}


class FigureWatch:
    """Fed with the sightings that the tracker accepted, stamped by `clock`; `notices` about once a second.

    `close_loops` any number of times between them spreads the work.
    """

    def __init__(self, field: ResolvedField, clock: str) -> None:
        self._field, self._clock = field, clock
        self._loops = SightLoops(field)
        self._suspicion = FigureSuspicion(self._loops.keys, field.cameras)
        self._told: tuple[Suspect, ...] = ()
        self.cause = ""

    def take(self, sighting: RelativeObservation, lean: Lean) -> None:
        """Take a sighting that the tracker accepted, and how its observer leans."""
        if sighting.header.clock == self._clock:
            self._loops.see(sighting, lean)

    def close_loops(self, now_ns: int) -> None:
        """Weigh the loops that have closed since."""
        for gap in self._loops.gaps(now_ns / NS_PER_S):
            self._suspicion.take(gap)

    def notices(self, now_ns: int) -> list[Notice]:
        """Return a new finding, or the end of one. `cause` is the finding that stands, in a few words, or ""."""
        self.close_loops(now_ns)
        charges = self._suspicion.judge(self._loops.levelled)
        suspects = tuple(sorted((one.suspect for one in charges), key=lambda s: (s.who, s.part)))
        before, self._told = self._told, suspects
        if suspects == before:
            return []
        self.cause = " or ".join(self._what(one) for one in charges[:_MOST_TOLD])
        if not charges:
            return [Notice(Severity.INFO, "no figure of the field is suspected any more: what was told is refuted")]
        text = f"{self.cause}: that explains best why the team's sightings do not meet"
        if len(charges) > 1:
            text += "; which of them cannot be told yet, the first is likeliest"
        remedies = "; or ".join(dict.fromkeys(self._remedy(one) for one in charges[:_MOST_TOLD]))
        return [Notice(Severity.WARNING, text, remedies, charges[0].suspect.who)]

    def _what(self, charge: Charge) -> str:
        who, part = charge.suspect.who, charge.suspect.part
        share = f"{100 * abs(charge.size):.1f} +- {100 * charge.std:.1f} %"
        degrees = f"{math.degrees(abs(charge.size)):.1f} +- {math.degrees(charge.std):.1f} deg"
        more = charge.size > 0.0
        fixed = who in self._field.cameras
        camera = "every drone's camera" if not who else f"the camera {who}" if fixed else f"{who}'s camera"
        match part:
            case "print":
                marker = f"{who}'s marker is" if who else "all markers are"
                return f"{marker} {share} {'larger' if more else 'smaller'} than the field says"
            case "focal":
                return f"{camera} has a focal length {share} {'longer' if more else 'shorter'} than calibrated"
            case "pan":
                return f"{camera} looks {degrees} farther to the {'left' if more else 'right'} than the field says"
            case "tilt":
                return f"{camera} looks {degrees} {'lower' if more else 'higher'} than the field says"
            case "z":
                off = f"{100 * abs(charge.size):.0f} +- {100 * charge.std:.0f} cm"
                return f"{camera} hangs {off} {'higher' if more else 'lower'} than the field says"
            case "tilted":
                return f"{camera} is tilted by {degrees} against the field"
            case _:
                late = f"{1e3 * abs(charge.size):.0f} +- {1e3 * charge.std:.0f} ms"
                pictures = f"{who}'s pictures" if fixed else f"the pictures of {who}'s camera"
                return f"{pictures} are {late} {'older' if more else 'newer'} than configured"

    def _remedy(self, charge: Charge) -> str:
        who, part = charge.suspect.who, charge.suspect.part
        if part == "print":
            return "measure it with a ruler; print it without scaling, or set its size in the field"
        if part == "focal":
            return f"calibrate the lens of {who} (groundstation calibrate camera)"
        if part == "delay":
            return "groundstation calibrate delay"
        if part in ("z", "tilted"):
            return f"fix the camera {who} where the field has it, or survey it anew (groundstation calibrate)"
        names = (who,) if who else tuple(self._field.drones)
        wanted = [f"drones.{name}.camera.{_SETTINGS[part]}: {self._now(name, part, charge.size):.1f}" for name in names]
        return f"fix the mounting, or set {', '.join(wanted)}"

    def _now(self, name: str, part: str, error_rad: float) -> float:
        camera = self._field.drones[name].camera
        return (camera.pan_left_deg if part == "pan" else camera.tilt_down_deg) + math.degrees(error_rad)
