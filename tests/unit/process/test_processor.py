"""Processor use, from the kernel's counters."""

import time

from groundstation.process import processor
from groundstation.process.processor import OwnUse


def test_work_counts_as_use_and_sleep_does_not() -> None:
    use, begin = OwnUse(), time.monotonic()
    end = time.process_time() + 0.2
    while time.process_time() < end:
        pass
    cpu, waited = use.since()
    assert cpu * (time.monotonic() - begin) > 0.19
    assert 0.0 <= waited <= 1.0
    begin = time.monotonic()
    time.sleep(0.2)
    assert use.since()[0] * (time.monotonic() - begin) < 0.1


def test_cores_are_busy_when_they_neither_idle_nor_wait_for_a_disk(monkeypatch, tmp_path) -> None:
    (tmp_path / "stat").write_text("cpu  100 20 30 4000 500 6 7 8 90 10\ncpu0 1 2 3 4 5 6 7 8 9 10\n")
    monkeypatch.setattr(processor, "_PROC", tmp_path)
    monkeypatch.setattr(processor, "_TICKS_PER_S", 100)
    assert processor.busy_s() == 1.71


def test_a_kernel_that_does_not_tell_is_no_failure(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(processor, "_PROC", tmp_path)
    assert processor.busy_s() is None
    assert processor.waited_ns() == 0


def test_waits_of_all_threads_are_added_up(monkeypatch, tmp_path) -> None:
    for thread, told in (("7", "1000 300 5"), ("8", "20 40 1"), ("9", "")):
        (tmp_path / "7/task" / thread).mkdir(parents=True)
        (tmp_path / "7/task" / thread / "schedstat").write_text(told)
    monkeypatch.setattr(processor, "_PROC", tmp_path)
    assert processor.all_waited_ns(7) == 340
    assert processor.all_waited_ns(8) == 0
