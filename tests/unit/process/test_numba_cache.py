"""The kernel cache belongs to one state of the sources; a cache folder chosen by the user is left alone."""

import os
from pathlib import Path

import pytest

from groundstation.process import numba_cache


def test_a_state_of_the_sources_has_its_own_directory(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    flight = numba_cache.activate()
    assert flight.parent == tmp_path / "skein"
    assert os.environ["NUMBA_CACHE_DIR"] == str(flight)
    assert numba_cache.sources_hash() == numba_cache.sources_hash()
    assert numba_cache.sources_hash() != numba_cache.sources_hash(numba_cache.EVERYTHING)


def test_a_chosen_directory_is_respected(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert numba_cache.activate() == tmp_path


def test_old_states_are_forgotten(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for number in range(32):
        folder = tmp_path / "skein" / f"numba-{number:02d}"
        folder.mkdir(parents=True)
        os.utime(folder, (number, number))
    (tmp_path / "skein" / "other").mkdir()
    numba_cache.activate()
    left = sorted(path.name for path in (tmp_path / "skein").iterdir())
    assert left == [*(f"numba-{number:02d}" for number in range(8, 32)), "other"]


def test_a_cache_of_more_begins_with_what_flies(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    flying = numba_cache.activate()
    (flying / "kernels").mkdir(parents=True)
    (flying / "kernels" / "a.nbi").write_bytes(b"compiled")
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    everything = numba_cache.activate(numba_cache.EVERYTHING)
    assert everything != flying
    assert (everything / "kernels" / "a.nbi").read_bytes() == b"compiled"
    (everything / "kernels" / "a.nbi").write_bytes(b"newer")
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    numba_cache.activate(numba_cache.EVERYTHING)
    assert (everything / "kernels" / "a.nbi").read_bytes() == b"newer", "begun once"


def test_a_cache_counts_as_complete_only_when_all_was_compiled(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = tmp_path / "numba-1"
    (folder / "another_checkouts_kernels").mkdir(parents=True)
    assert not numba_cache.is_complete(folder)
    numba_cache.mark_complete(folder)
    assert numba_cache.is_complete(folder)
    monkeypatch.setattr(numba_cache, "__file__", "/another/checkout/groundstation/process/numba_cache.py")
    assert not numba_cache.is_complete(folder)


def test_another_process_compiles_what_it_is_asked_for(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "a_module_that_tells.py").write_text("import pathlib; pathlib.Path(__file__ + '.imported').touch()")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    other = numba_cache.ParallelCompilation(["a_module_that_tells", "a_module_that_is_missing"])
    assert not other.finish()  # an error there is no failure here: missing kernels are compiled at their import
    assert (tmp_path / "a_module_that_tells.py.imported").exists()
