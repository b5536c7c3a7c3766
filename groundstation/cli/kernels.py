"""Prepares compiled kernels for commands: chooses their cache, and reports that compiling takes a while."""

import click

from groundstation.process import numba_cache

_TOLD = "compiling kernels (once per version, a minute or two)"


def use_flying_kernels() -> None:
    """Use the cache of the kernels that fly, and compile missing ones; raises GroundStationError if it is read-only."""
    cache = numba_cache.activate()
    if numba_cache.is_complete(cache):
        return
    numba_cache.require_writable(cache)
    click.echo(_TOLD, err=True)
    from groundstation.runtime.compile_kernels import compile_kernels

    compile_kernels(cache)


def use_kernels_of_plug_in() -> None:
    """Use the cache of the kernels that fly for a plug-in that imports some of them; missing ones compile then."""
    if not numba_cache.activate().exists():
        click.echo(_TOLD, err=True)


def use_all_kernels() -> None:
    """Use the cache for kernels of experiments and benches too, which compile at import."""
    cache = numba_cache.activate(numba_cache.EVERYTHING)
    if not cache.exists():
        numba_cache.require_writable(cache)
        click.echo(_TOLD, err=True)
