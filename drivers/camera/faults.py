"""Faults of printed markers that a person must put right: mirrored, wrong size, used twice, or unknown."""

from collections import Counter, defaultdict
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from drivers.camera.settings import MarkerSettings
from drivers.camera.size_check import SizeCheck
from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.time_units import NS_PER_S

_MIRRORED_TIMES = 5
_FLIP = "switch off the camera's flip"
# An unknown code is reported after this many readings over this time: now and then a code is misread.
_FOREIGN_TIMES, _FOREIGN_NS, _MISREAD_NS = 4, 3 * NS_PER_S, 30 * NS_PER_S


class MarkerFaults:
    """Collects signs of faults and words each fault once."""

    def __init__(self) -> None:
        self._sizes: defaultdict[str, SizeCheck] = defaultdict(SizeCheck)
        self._identified: set[str] = set()
        self._mirrored: Counter[str] = Counter()
        self._foreign: dict[int, tuple[int, int]] = {}
        self._notices: list[Notice] = []
        self._told: set[tuple[str, str]] = set()

    def take(self) -> list[Notice]:
        """Return the faults that are not reported yet, and forget them."""
        notices, self._notices = self._notices, []
        return notices

    def identified(self, entity: str) -> None:
        """Take in that the marker of an entity reads as it should."""
        self._identified.add(entity)

    def mirrored(self, marker: MarkerSettings) -> None:
        """Take in that a marker reads in a mirror; several times, since clutter may look like one."""
        self._mirrored[marker.entity] += 1
        wrong = sorted(entity for entity, times in self._mirrored.items() if times >= _MIRRORED_TIMES)
        if marker.entity not in wrong:
            return
        if len(wrong) > 1 and not self._identified:
            text = f"the picture is mirrored: it shows the markers of {' and '.join(wrong[:2])} the wrong way round"
            self._tell("picture", Notice(Severity.WARNING, text, f"{_FLIP} (its mirror setting)"))
            return
        text = f"the {marker.label} of {marker.entity} is mirrored and cannot be used"
        remedy = "print it again, not mirrored" + f", or {_FLIP}" * (not self._identified)
        self._tell("mirrored", Notice(Severity.WARNING, text, remedy, marker.entity))

    def measured(
        self, marker: MarkerSettings, stamp_ns: int, relative_m: NDArray[np.float64], drop_m: float | None
    ) -> None:
        """Take in a marker's place relative to the camera [m; z up], and its depth below by height sensors [m]."""
        check = self._sizes[marker.entity]
        check.add(stamp_ns, relative_m, drop_m)
        ratio = check.ratio
        if ratio is not None:
            text = f"the {marker.label} of {marker.entity} seems {ratio:.2f} times as far as height sensors say"
            remedy = f"measure it: {marker.size_mm:g} mm are set, {marker.size_mm / ratio:.0f} mm would fit"
            self._tell("size", Notice(Severity.WARNING, text, remedy, marker.entity))

    def doubled(self, marker: MarkerSettings) -> None:
        """Take in that several markers in view carry one identity."""
        text = f"several markers in view carry the identity of {marker.entity} ({marker.label})"
        self._tell(
            "double",
            Notice(Severity.WARNING, text, "remove all but one, or give them identities of their own", marker.entity),
        )

    def foreign(self, code: int, stamp_ns: int, expected: Iterable[MarkerSettings]) -> None:
        """Take in a board with a code that the field assigns to nobody; it may be a misread one."""
        first_ns, times = self._foreign.get(code, (stamp_ns, 0))
        if stamp_ns - first_ns > _MISREAD_NS:
            first_ns, times = stamp_ns, 0
        self._foreign[code] = (first_ns, times + 1)
        if times + 1 < _FOREIGN_TIMES or stamp_ns - first_ns < _FOREIGN_NS:
            return
        unseen = [f"{marker.entity} ({marker.label})" for marker in expected if marker.entity not in self._identified]
        whose = f"that of {' or '.join(unseen)}, not seen here so far" if unseen else "that of a vehicle or target"
        remedy = f"if it is {whose}, set its code in the field; else cover or remove it"
        text = f"marker {code} is in view, which the field gives to nobody"
        self._tell(f"foreign {code}", Notice(Severity.WARNING, text, remedy))

    def _tell(self, kind: str, notice: Notice) -> None:
        if (kind, notice.entity) not in self._told:
            self._told.add((kind, notice.entity))
            self._notices.append(notice)
