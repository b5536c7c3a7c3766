"""`groundstation bench ardrone` times what it says it times."""

import json

import pytest
from click.testing import CliRunner

from drivers.ardrone.wire import navdata, options
from groundstation.cli import bench_ardrone


def test_the_packet_is_full_and_good():
    packet = bench_ardrone.full_packet()
    assert len(packet) == 1916
    assert [tag for tag, _ in navdata.decode(packet).options] == list(range(28))
    assert bench_ardrone.bare_loop(packet) == 28
    assert bench_ardrone.bare_loop(packet[:-1] + b"\x77") == -1
    assert bench_ardrone.read_everything(packet) == len(options.LAYOUTS) - 1, "tag 27 has one of two meanings"


@pytest.mark.parametrize("arguments", [["--json"], []])
def test_it_reports_every_figure(arguments):
    result = CliRunner().invoke(bench_ardrone.ardrone, ["--count", "10", "--rounds", "1", *arguments])
    assert result.exception is None, result.output
    if arguments:
        times = json.loads(result.output)["times"]
        assert all(row is None or 0 < row["min_us"] <= row["median_us"] for row in times.values())
        assert times["navdata: packet and all options"] and "peer: pyardrone, all options" in times
    else:
        assert "limit for packet and all options: 60 us" in result.output
