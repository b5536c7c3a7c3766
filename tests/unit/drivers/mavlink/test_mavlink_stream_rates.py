"""Streams that another station slowed down are requested again; those of a narrow or lossy link not for ever."""

import pytest

from drivers.mavlink.stream_rates import StreamRates
from drivers.mavlink.wire.telemetry import AttitudeQuaternion, BatteryStatus, LocalPositionNed

S = 1_000_000_000
RATES = {LocalPositionNed: 50.0, AttitudeQuaternion: 50.0, BatteryStatus: 1.0}


def hear(rates, hz_of, seconds, begin_s=0.0):
    """Return (seconds, streams) of each request."""
    asked = []
    for turn in range(round(begin_s * 100), round((begin_s + seconds) * 100)):
        for kind, hz in hz_of.items():
            if hz and turn % round(100 / hz) == 0:
                rates.take(kind)
        if again := rates.step(turn * S // 100):
            asked.append((turn / 100, again))
    return asked


@pytest.mark.parametrize("hz", [2, 4, 10])
def test_slow_streams_are_requested_again_after_two_seconds(hz):
    rates = StreamRates(RATES)
    ((at_s, again), *_) = hear(rates, {LocalPositionNed: hz, AttitudeQuaternion: hz}, 2.5)
    assert at_s == pytest.approx(2.0, abs=0.02) and again == [LocalPositionNed, AttitudeQuaternion]
    assert rates.words == f"its velocity comes at {hz} of 50 Hz"


def test_a_slow_one_is_noticed_in_a_flight_that_was_well():
    rates = StreamRates(RATES)
    assert not hear(rates, {LocalPositionNed: 50, AttitudeQuaternion: 50}, 30.0) and not rates.words
    ((at_s, _), *_) = hear(rates, {LocalPositionNed: 2, AttitudeQuaternion: 50}, 2.1, 30.0)
    assert at_s <= 32.0
    assert not hear(rates, {LocalPositionNed: 50, AttitudeQuaternion: 50}, 10.0, 32.1) and not rates.words


def test_a_link_that_carries_no_more_is_asked_three_times():
    rates = StreamRates(RATES)
    asked = hear(rates, {LocalPositionNed: 10, AttitudeQuaternion: 50}, 30.0)
    assert [again for _, again in asked] == [[LocalPositionNed]] * 3
    assert rates.words == "its velocity comes at 10 of 50 Hz"
    assert not hear(rates, {LocalPositionNed: 50, AttitudeQuaternion: 50}, 5.0, 30.0)
    assert len(hear(rates, {LocalPositionNed: 2, AttitudeQuaternion: 50}, 3.0, 35.0)) == 1, "slowed down anew"


def test_half_of_all_frames_lost_and_streams_that_ended_are_none_of_its_business():
    rates = StreamRates(RATES)
    assert not hear(rates, {LocalPositionNed: 25, AttitudeQuaternion: 0, BatteryStatus: 0}, 10.0)


@pytest.mark.parametrize("pause_s", [0.3, 0.9, 1.3, 1.7, 2.5])
@pytest.mark.parametrize("begin_s", [3.0, 3.2, 3.4])
def test_a_link_that_pauses_is_no_other_stations_work(pause_s, begin_s):
    rates = StreamRates(RATES)
    hear(rates, {LocalPositionNed: 50, AttitudeQuaternion: 50}, begin_s)
    assert not hear(rates, {}, pause_s, begin_s)
    assert not hear(rates, {LocalPositionNed: 50, AttitudeQuaternion: 50}, 3.0, begin_s + pause_s)


def test_a_pause_of_the_loop_is_no_slow_stream():
    rates = StreamRates(RATES)
    hear(rates, {LocalPositionNed: 50, AttitudeQuaternion: 50}, 3.0)
    assert not hear(rates, {LocalPositionNed: 50, AttitudeQuaternion: 50}, 3.0, 9.0)
