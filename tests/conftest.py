"""What all tests share: compiled kernels come from a cache that knows the state of their sources."""

from groundstation.process import numba_cache

numba_cache.activate()
