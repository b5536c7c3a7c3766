"""Turns successive verdicts into notices for the operator: new suspicions, and refuted ones. Pure."""

import math

from groundstation.bus.messages import Severity, SuspectedFigure
from groundstation.bus.notice import Notice
from groundstation.diagnosis.suspects import Charge, Suspect, Verdict
from groundstation.diagnosis.wording import remedies, sentence
from groundstation.field.resolved import ResolvedField

_REFUTED = math.log(3.0)
# Stands for all that is no figure: streams or markers of others, clocks.
_NO_FIGURE: tuple[Suspect, ...] = (("", "no figure"),)
_UNEXPLAINED = "the team's sightings disagree, and no single wrong figure explains it"
_UNEXPLAINED_REMEDY = (
    "check that each video stream and each marker's id is that of its drone, and the clocks of the cameras' hosts"
)


class FigureWatch:
    """Takes verdicts, without action on the flight. `cause`: the standing suspicion in a few words, or ""."""

    def __init__(self, field: ResolvedField) -> None:
        self._field = field
        self._standing: dict[tuple[Suspect, ...], SuspectedFigure] = {}

    @property
    def figures(self) -> tuple[SuspectedFigure, ...]:
        """Return the standing suspicions: reported, and not refuted."""
        return tuple(self._standing.values())

    @property
    def cause(self) -> str:
        """Return the best explanation of sightings that disagree."""
        return "; ".join(figure.text for figure in self.figures)

    def take(self, verdict: Verdict, now_ns: int) -> list[Notice]:
        """Return the notices that follow from a verdict reached at this time."""
        named = {(key := _suspects(one)): self._suspected(key, one, now_ns) for one in verdict.causes}
        if verdict.is_unexplained:
            named = {_NO_FIGURE: self._no_figure(now_ns)}
        notices = [_accusation(figure, key) for key, figure in named.items() if key not in self._standing]
        accused = {suspect for key in named for suspect in key}
        # Other figures explain the flight now, unless a standing suspicion was found again together with them.
        replaced = bool(named) and not named.keys() & self._standing.keys()
        kept = dict[tuple[Suspect, ...], SuspectedFigure]()
        for key, figure in self._standing.items():
            if not accused.isdisjoint(key):
                continue  # told again, alone or beside others that cannot be told apart
            if replaced or all(verdict.leads.get(s, 0.0) < _REFUTED for s in key):
                over = "no longer so" if key == _NO_FIGURE else "no longer suspected"
                notices.append(Notice(Severity.INFO, f"{figure.text}: {over}", entity=key[0][0]))
            else:
                kept[key] = figure
        self._standing = named | kept
        return notices

    def _suspected(self, key: tuple[Suspect, ...], charges: tuple[Charge, ...], now_ns: int) -> SuspectedFigure:
        known = self._standing.get(key)
        who, text, remedy = charges[0].suspect[0], sentence(charges, self._field), remedies(charges, self._field)
        about = ", ".join(" ".join(suspect).strip() for suspect in key)
        return SuspectedFigure(who, text, remedy, known.told_ns if known else now_ns, about)

    def _no_figure(self, now_ns: int) -> SuspectedFigure:
        known = self._standing.get(_NO_FIGURE)
        told_ns = known.told_ns if known else now_ns
        return SuspectedFigure("", _UNEXPLAINED, _UNEXPLAINED_REMEDY, told_ns, _NO_FIGURE[0][1])


def _accusation(figure: SuspectedFigure, key: tuple[Suspect, ...]) -> Notice:
    if key == _NO_FIGURE:
        return Notice(Severity.WARNING, figure.text, figure.remedy)
    text = f"{figure.text}: that explains best why the team's sightings disagree"
    if len(key) > 1:
        text += "; which of them it is cannot be told yet, the first is the most likely"
    return Notice(Severity.WARNING, text, figure.remedy, figure.entity)


def _suspects(charges: tuple[Charge, ...]) -> tuple[Suspect, ...]:
    return tuple(sorted(charge.suspect for charge in charges))
