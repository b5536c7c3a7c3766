"""Use of the processor, as the kernel tells it."""

import time

from groundstation.process import processor
from groundstation.process.processor import OwnUse


def test_work_counts_as_use_and_sleep_does_not() -> None:
    use = OwnUse()
    end = time.process_time() + 0.2
    while time.process_time() < end:
        pass
    assert use.since()[0] > 0.05
    time.sleep(0.2)
    cpu, waited = use.since()
    assert cpu < 0.5
    assert 0.0 <= waited <= 1.0


def test_cores_are_busy_when_they_neither_idle_nor_wait_for_a_disk(monkeypatch, tmp_path) -> None:
    told = tmp_path / "stat"
    told.write_text("cpu  100 20 30 4000 500 6 7 8 90 10\ncpu0 1 2 3 4 5 6 7 8 9 10\n")
    monkeypatch.setattr(processor, "_COMPUTER", told)
    monkeypatch.setattr(processor, "_TICKS_PER_S", 100)
    assert processor.busy_s() == 1.71


def test_a_kernel_that_does_not_tell_is_no_failure(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(processor, "_COMPUTER", tmp_path / "absent")
    monkeypatch.setattr(processor, "_OWN_WAITS", tmp_path / "absent")
    assert processor.busy_s() is None
    assert processor.waited_ns() == 0
