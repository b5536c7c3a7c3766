"""The meaning of each entry of the joint state."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum


class EntityKind(StrEnum):
    """The kind of entity that a block of the state describes."""

    ROBOT = "robot"
    TARGET = "target"
    CAMERA = "camera"
    LANDMARK = "landmark"


ROBOT_CORE = ("x", "y", "z", "yaw")
TARGET_CORE = ("x", "y", "vx", "vy")
CARRIER_LABELS = (*ROBOT_CORE, "roll_error", "pitch_error")
CORE_SIZE = 4
_Slice = slice


@dataclass(frozen=True, slots=True)
class Block:
    """One entity's entries: robots and cameras begin with x, y, z, yaw; targets with x, y, vx, vy [world].

    slice: its place in the state.
    """

    name: str
    kind: EntityKind
    start: int
    labels: tuple[str, ...]
    slice: _Slice = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "slice", slice(self.start, self.start + self.size))

    @property
    def size(self) -> int:
        """Return the number of entries."""
        return len(self.labels)


@dataclass(frozen=True, slots=True)
class StateLayout:
    """Blocks in state order; names are unique. dim, robots, targets: of all blocks; names in state order."""

    blocks: tuple[Block, ...] = ()
    dim: int = field(init=False, repr=False, compare=False)
    robots: tuple[str, ...] = field(init=False, repr=False, compare=False)
    targets: tuple[str, ...] = field(init=False, repr=False, compare=False)
    _by_name: Mapping[str, Block] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name, value in (
            ("dim", sum(block.size for block in self.blocks)),
            ("robots", tuple(block.name for block in self.blocks if block.kind is EntityKind.ROBOT)),
            ("targets", tuple(block.name for block in self.blocks if block.kind is EntityKind.TARGET)),
            ("_by_name", {block.name: block for block in self.blocks}),
        ):
            object.__setattr__(self, name, value)

    @property
    def labels(self) -> tuple[str, ...]:
        """Return `entity.entry` for every entry, for the bus."""
        return tuple(f"{block.name}.{label}" for block in self.blocks for label in block.labels)

    def __contains__(self, name: str) -> bool:
        return name in self._by_name

    def block(self, name: str) -> Block:
        """Return an entity's block; raises KeyError when it is not in the state."""
        return self._by_name[name]

    def with_entity(self, name: str, kind: EntityKind, labels: tuple[str, ...]) -> "StateLayout":
        """Return the layout with one more block at the end; raises ValueError when it is already there."""
        if name in self:
            raise ValueError(f"{name} is already in the state")
        return StateLayout((*self.blocks, Block(name, kind, self.dim, labels)))
