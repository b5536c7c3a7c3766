"""The joint Gaussian belief as a value."""

from collections.abc import Collection
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from groundstation.arrays import Array, IntArray
from groundstation.estimation.layout import CORE_SIZE, EntityKind, StateLayout


@dataclass(frozen=True, slots=True)
class JointBelief:
    """Mean (n) and covariance (n, n) of the state described by `layout`, valid at `stamp_ns`; read-only."""

    mean: Array
    covariance: Array
    layout: StateLayout
    stamp_ns: int

    def __post_init__(self) -> None:
        n = self.layout.dim
        for name, shape in (("mean", (n,)), ("covariance", (n, n))):
            value = np.asarray(getattr(self, name), dtype=np.float64)
            if value.flags.writeable:  # somebody may still write into it
                value = value.copy()
            if value.shape != shape or not np.isfinite(value).all():
                raise ValueError(f"{name} must be finite with shape {shape}")
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def mean_of(self, name: str) -> Array:
        """Return an entity's part of the mean."""
        return self.mean[self.layout.block(name).slice]

    def covariance_of(self, name: str) -> Array:
        """Return an entity's own covariance."""
        part = self.layout.block(name).slice
        return self.covariance[part, part]

    def core(self, without: Collection[str] = ()) -> "JointBelief":
        """Return the belief of robots' (x, y, z, yaw) and targets' (x, y, vx, vy) alone, the rest marginalised.

        without: names of those that are left out too.
        """
        layout, kept = _core_of(self.layout, frozenset(without))
        mean, covariance = self.mean[kept[1][0]], self.covariance[kept]
        mean.flags.writeable = covariance.flags.writeable = False
        return JointBelief(mean, covariance, layout, self.stamp_ns)


@lru_cache(maxsize=64)
def _core_of(layout: StateLayout, without: frozenset[str]) -> tuple[StateLayout, tuple[IntArray, ...]]:
    """Return the layout of the core, and its entries as indices of rows and columns."""
    blocks = [b for b in layout.blocks if b.kind in (EntityKind.ROBOT, EntityKind.TARGET) and b.name not in without]
    kept = [block.start + i for block in blocks for i in range(CORE_SIZE)]
    core = StateLayout()
    for block in blocks:
        core = core.with_entity(block.name, block.kind, block.labels[:CORE_SIZE])
    return core, np.ix_(kept, kept)
