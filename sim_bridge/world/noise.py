"""Seeded random processes and delays, one plain float per tick."""

import itertools
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
    """Return the generator of one body; other bodies do not change its draws."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


def _blocks(rng: np.random.Generator) -> Iterator[list[float]]:
    while True:
        yield rng.standard_normal(_BLOCK).tolist()


def standard_normals(rng: np.random.Generator) -> Draw:
    """Return a function that draws one standard normal; it draws blocks, since single draws cost ten times more."""
    return itertools.chain.from_iterable(_blocks(rng)).__next__


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


class Vibration:
    """Noise of unit variance: a swing about zero, whose integral does not wander, and a share of white noise.

    half_ticks: time on one side; white_share: deviation of the white part, whose integral wanders.
    """

    __slots__ = ("_before", "_draw", "_gain", "_line", "_since", "_white")

    def __init__(self, half_ticks: int, white_share: float, draw: Draw) -> None:
        self._line = deque([0.0] * (2 * half_ticks), maxlen=2 * half_ticks)
        self._draw, self._white = draw, white_share
        self._since = self._before = 0.0
        # Both parts have the newest draw in common: its coefficient is the sum of theirs.
        shared = white_share / math.sqrt(2.0 * half_ticks)
        swinging = math.sqrt(shared**2 + 1.0 - white_share**2) - shared
        self._gain = swinging / math.sqrt(2.0 * half_ticks)

    def step(self) -> float:
        """Advance by one tick and return the value."""
        line, newest = self._line, self._draw()
        middle = line[len(line) // 2]
        self._since += newest - middle
        self._before += middle - line[0]
        line.append(newest)
        return self._gain * (self._since - self._before) + self._white * newest


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
