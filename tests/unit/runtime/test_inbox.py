"""The tracker's limit on messages per tick; the excess is counted."""

import pytest

from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import ImuSample
from groundstation.bus.topics import IMU
from groundstation.runtime import inbox
from groundstation.runtime.inbox import Inbox


def test_messages_dropped_after_a_stall_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inbox, "_MAX_PER_TICK", 3)
    exchange = MemoryExchange()
    taken, driver = Inbox(MemoryBus(exchange, "lab", "tracker")), MemoryBus(exchange, "lab", "drone_1")
    for _ in range(5):
        sample = ImuSample(
            header=driver.header("drone_1"), angular_velocity_rad_s=(0, 0, 0), specific_force_m_s2=(0, 0, 9.8)
        )
        driver.publish(IMU, sample)
    assert len(taken.pop_ready()) == 3 and taken.overflowed == 2
    assert taken.pop_ready() == [] and taken.overflowed == 2
