"""Compiled kernels before a command needs them: where they are kept, and that compiling takes a while."""

import click

from groundstation.process import numba_cache

_TOLD = "compiling kernels (once per version, a minute or two)"


def use_flying_kernels() -> None:
    """Let the kernels that fly be found, and compile what lacks; raises GroundStationError where none can be kept."""
    cache = numba_cache.activate()
    if numba_cache.is_complete(cache):
        return
    numba_cache.require_writable(cache)
    click.echo(_TOLD, err=True)
    from groundstation.runtime.compile_kernels import compile_kernels

    compile_kernels(cache)


def use_all_kernels() -> None:
    """Let those of experiments and benches be found as well, which are compiled where they are imported."""
    cache = numba_cache.activate(numba_cache.EVERYTHING)
    if not cache.exists():
        numba_cache.require_writable(cache)
        click.echo(_TOLD, err=True)
