"""A drone that receives nothing for 0.8 s while its telemetry arrives: the operator is warned, then told of its end."""

import time

import pytest

from groundstation.bus.topics import EVENT
from sim_bridge.conformance.bench import Bench
from sim_bridge.conformance.subject import subject_of


@pytest.mark.slow
@pytest.mark.sitl
def test_a_cut_of_the_uplink_is_told_in_flight():
    with Bench(subject_of("ardrone")) as bench:
        bench.track()
        time.sleep(1.0)
        bench.emulator.deaf = True
        time.sleep(0.8)
        bench.emulator.deaf = False
        time.sleep(1.0)
        texts = [one.message.text for one in bench.record.heard(EVENT)]
    assert [text for text in texts if "obeyed no command for" in text], texts
    assert [text for text in texts if "commands arrive again after" in text], texts
