"""Seeded random processes and delays, one plain float per tick."""

import math
import zlib
from collections import deque
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

import numpy as np

Draw = Callable[[], float]
T = TypeVar("T")
_BLOCK = 1024


def generator_of(seed: int, name: str) -> np.random.Generator:
    """Return the generator of one body: another body more or less does not change its draws."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


def _blocks(rng: np.random.Generator) -> Iterator[float]:
    while True:
        yield from rng.standard_normal(_BLOCK).tolist()


def standard_normals(rng: np.random.Generator) -> Draw:
    """Return a function that draws one standard normal; it draws blocks, since single draws cost ten times more."""
    return _blocks(rng).__next__


class GaussMarkov:
    """First-order Gauss-Markov process of a given deviation and correlation time, stationary from the start."""

    __slots__ = ("_decay", "_draw", "_drive", "value")

    def __init__(self, deviation: float, correlation_s: float, tick_s: float, draw: Draw) -> None:
        self._decay = math.exp(-tick_s / correlation_s)
        self._drive = deviation * math.sqrt(1.0 - self._decay**2)
        self._draw = draw
        self.value = deviation * draw()

    def step(self) -> float:
        """Advance by one tick and return the value."""
        self.value = self._decay * self.value + self._drive * self._draw()
        return self.value


class DelayLine(Generic[T]):
    """Returns the value pushed `delay` ago, rounded up to whole ticks; before that, the first one."""

    __slots__ = ("_line",)

    def __init__(self, delay_s: float, tick_s: float, start: T) -> None:
        ticks = math.ceil(delay_s / tick_s - 1e-9)
        self._line = deque([start] * (ticks + 1), maxlen=ticks + 1)

    def push(self, value: T) -> T:
        """Push the value of this tick and return the delayed one."""
        self._line.append(value)
        return self._line[0]
