"""A target that switches between straight driving and turning: interacting multiple models."""

from dataclasses import dataclass, field
from typing import ClassVar

from groundstation.arrays import Array
from groundstation.estimation.layout import EntityKind
from groundstation.estimation.model_kernels import MotionKernels
from groundstation.estimation.models.coordinated_turn import CoordinatedTurnTarget
from groundstation.estimation.models.protocol import MotionModel, Vector3
from groundstation.kernel import Record


@dataclass(frozen=True, slots=True)
class ManoeuvringTarget:
    """Several models of one target with equal labels; it stays in each for `stay_s` on average.

    The filter keeps one joint belief per mode and mixes them whole (modes.py).
    """

    kind: ClassVar[EntityKind] = EntityKind.TARGET
    present: ClassVar[bool] = False
    admitted: ClassVar[bool] = True

    modes: tuple[MotionModel, ...] = field(
        default_factory=lambda: (
            CoordinatedTurnTarget(acceleration_std_m_s2=0.1, turning=False),
            CoordinatedTurnTarget(),
        )
    )
    stay_s: tuple[float, ...] = (4.0, 2.0)

    def __post_init__(self) -> None:
        if len(self.modes) < 2 or len(self.modes) != len(self.stay_s):
            raise ValueError("a manoeuvring target needs at least two modes and as many stay_s")
        if len({mode.labels for mode in self.modes}) != 1:
            raise ValueError("all modes of a target need the same labels")
        if min(self.stay_s) <= 0.0:
            raise ValueError("stay_s must be positive")

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the entries of the block."""
        return self.modes[0].labels

    @property
    def kernels(self) -> MotionKernels:
        """Return the kernels of the first mode."""
        return self.modes[0].kernels

    @property
    def place_m(self) -> Vector3:
        """Return the marker's place, the same in all modes."""
        return self.modes[0].place_m

    def own(self) -> Record | None:
        """Return the parameters of the first mode."""
        return self.modes[0].own()

    def prior(self) -> Array:
        """Return mean and variances of its block when it joins, the same in all modes."""
        return self.modes[0].prior()
