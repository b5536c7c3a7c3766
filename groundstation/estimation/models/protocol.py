"""Interface of a model: its parameters in Python, and its kernels.

A new model is one file: a frozen dataclass of its figures with these members, its kernels as model_kernels.py declares
them, and a Record of what they read. No other code needs to know it (docs/how-to/add-a-sensor-model.md 1,
docs/how-to/add-a-model-of-motion.md 1).
"""

from typing import Protocol, runtime_checkable

from groundstation.arrays import Array
from groundstation.estimation.layout import EntityKind
from groundstation.estimation.model_kernels import MotionKernels, SensorKernels
from groundstation.estimation.records import EntityMemory
from groundstation.kernel import Record

Vector3 = tuple[float, float, float]


class MotionModel(Protocol):
    """A motion model of one entity: x' = f(x), F and Q are in the kernel behind `kernels`."""

    @property
    def kind(self) -> EntityKind:
        """Kind of entity that the block describes."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Entries of the block, which begins with the entries of layout.py."""

    @property
    def kernels(self) -> MotionKernels:
        """The kernels."""

    @property
    def present(self) -> bool:
        """Return whether its prior alone puts it into the state."""

    @property
    def admitted(self) -> bool:
        """Return whether it may be in the state without permission (a vehicle that must fly first may not)."""

    @property
    def place_m(self) -> Vector3:
        """The centre of its marker [base] or, without a block, where it stands [world]."""

    def own(self) -> Record | None:
        """Return the parameters that its kernels read (`own_parameters`)."""

    def prior(self) -> Array:
        """Return mean and variances (2, size) of its block as it joins; a measured pose overwrites the pose entries."""


@runtime_checkable
class DrivenModel(MotionModel, Protocol):
    """An entity with odometry: the delays of its samples, and its velocity by the state."""

    @property
    def velocity_delay_s(self) -> float:
        """Delay of a velocity's stamp after its time of measurement; negative for a command that is followed later."""

    @property
    def height_delay_s(self) -> float:
        """Delay of a height's stamp after its time of measurement."""

    def velocity_m_s(self, block: Array, memory: EntityMemory) -> Vector3:
        """Return the velocity [world] from the block's mean and the held inputs."""


@runtime_checkable
class SwitchingModel(MotionModel, Protocol):
    """An entity that moves by one of several models with equal labels."""

    @property
    def modes(self) -> tuple[MotionModel, ...]:
        """The models."""

    @property
    def stay_s(self) -> tuple[float, ...]:
        """Mean time for which it stays with each."""


class ObservationModel(Protocol):
    """The model of one sensor: z = h(x) + v with h and its Jacobians behind `kernels`."""

    @property
    def carrier(self) -> str:
        """The entity that carries it: a robot, or one fixed in the world."""

    @property
    def observes_targets(self) -> bool:
        """Return whether it may be used for targets."""

    @property
    def repeats_s(self) -> float:
        """Time for which a pair's error repeats [s]: all readings of that time carry the information of one."""

    @property
    def stamp_std_s(self) -> float:
        """Standard deviation of the time of measurement."""

    @property
    def kernels(self) -> SensorKernels:
        """The kernels."""

    @property
    def angles(self) -> tuple[int, ...]:
        """Rows of z that are angles."""

    def own(self) -> Record | None:
        """Return the parameters that its kernels read (`own_parameters`)."""


class SensorDefaults:
    """Defaults shared by most sensors; a different model overrides them."""

    @property
    def observes_targets(self) -> bool:
        """Return that it may be used for targets."""
        return True

    @property
    def repeats_s(self) -> float:
        """Return that errors do not repeat."""
        return 0.0

    @property
    def stamp_std_s(self) -> float:
        """Return that the time of measurement is exact."""
        return 0.0

    @property
    def angles(self) -> tuple[int, ...]:
        """Return that no row is an angle."""
        return ()

    def own(self) -> Record | None:
        """Return nothing: there are no parameters."""
        return None


def place_of(labels: tuple[str, ...], wanted: str) -> int:
    """Return the index of a label in a block, or -1."""
    return labels.index(wanted) if wanted in labels else -1
