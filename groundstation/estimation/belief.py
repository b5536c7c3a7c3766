"""The joint Gaussian belief as a value."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
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
            value = np.array(getattr(self, name), dtype=np.float64)
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
        blocks = [b for b in self.layout.blocks if b.kind is not EntityKind.CAMERA and b.name not in without]
        kept = [block.start + i for block in blocks for i in range(CORE_SIZE)]
        layout = StateLayout()
        for block in blocks:
            layout = layout.with_entity(block.name, block.kind, block.labels[:CORE_SIZE])
        return JointBelief(self.mean[kept], self.covariance[np.ix_(kept, kept)], layout, self.stamp_ns)
