"""What a link refused, by reason, and of whose frames, where that is certain. Pure."""

from collections import Counter
from collections.abc import Mapping

DUPLICATE = "duplicate_system"


class LinkRefusals(Counter[str]):
    """Counts by reason; vehicles of one link share them, but for frames that are known to be of another one."""

    def __init__(self, counts: Mapping[str, int] | None = None) -> None:
        super().__init__(counts)
        self._of: Counter[tuple[str, int]] = Counter()

    def note(self, reason: str, system: int) -> None:
        """Count a verified frame of a vehicle."""
        self[reason] += 1
        self._of[reason, system] += 1

    def seen_by(self, system: int) -> Counter[str]:
        """Return the counts without those of other vehicles; from any thread."""
        counts = Counter(dict(self))
        for (reason, one), number in self._of.copy().items():
            if one != system:
                counts[reason] -= number
        return +counts

    def doubled(self, system: int) -> int:
        """Return how many frames with a vehicle's system id came from a second address."""
        return self._of[DUPLICATE, system]
