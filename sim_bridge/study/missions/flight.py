"""One mission: take-off, tracking, and the order to land; judged by truth from lift-off until all drones stand."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from sim_bridge.study.faults.draw import Drawn
from sim_bridge.study.faults.flight import DOWN, FaultFlight
from sim_bridge.study.faults.vehicles import Section

_DOWN_BY_S = 15.0
_STAND = frozenset({"LANDED", "CUT"})


class MissionFlight(FaultFlight):
    """A flight that ends with LAND. covariance_share: stated share of the sightings' true covariance."""

    def __init__(self, drawn: Drawn, sections: Sequence[Section], seconds: float, covariance_share: float) -> None:
        super().__init__(drawn, sections, seconds)
        self._wrong = replace(self._wrong, covariance_share=covariance_share)
        self._landing_since_s: float | None = None
        self._landed_before: list[str] = []

    def is_over(self) -> bool:
        """Return whether all stand again, or should by now; orders LAND when the time of tracking is over."""
        over = super().is_over()
        if not over or self.tracking_since_s is None:
            return over
        if self._landing_since_s is None:
            self._landing_since_s = self.world.time_s
            self._landed_before = [name for name, mode in self.modes().items() if mode in DOWN]
            self.orders.land(self.now_ns, self.drivers.hosts)
        stand = not self.world.airborne and all(mode in _STAND for mode in self.modes().values())
        return stand or self.world.time_s - self._landing_since_s >= _DOWN_BY_S

    def fly(self) -> dict[str, Any]:
        """Fly to the end; landed_before: drones that came down without the order, as their drivers say.

        landed: whether all stand at the end, by truth.
        """
        report = self.run()
        judged = ("separation_m", "fence_m", "obstacle_m", "unsafe", "unlocalised_s")
        return {
            "seed": report["seed"],
            "path": self.scenario.target.path.shape,
            "covariance_share": self._wrong.covariance_share,
            "flown": report["tracking_since_s"] is not None,
            **{name: report[name] for name in judged if name in report},
            "landing_since_s": self._landing_since_s,
            "landed_before": self._landed_before,
            "landed": not self.world.airborne,
            "planning": report["planning"],
            "spent_s": report["spent_s"],
        }
