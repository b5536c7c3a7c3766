"""`groundstation bench ardrone` times the operations that it names."""

import json

import pytest
from click.testing import CliRunner

from drivers.ardrone.wire import navdata, options
from groundstation.bench.ardrone import bare_loop, full_packet, read_everything
from groundstation.cli.bench_ardrone import ardrone


def test_the_packet_is_full_and_good():
    packet = full_packet()
    assert len(packet) == 1916
    assert [tag for tag, _ in navdata.decode(packet).options] == list(range(28))
    assert bare_loop(packet) == 28
    assert bare_loop(packet[:-1] + b"\x77") == -1
    assert read_everything(packet) == len(options.LAYOUTS) - 1, "tag 27 has one of two meanings"


@pytest.mark.parametrize("arguments", [["--json"], []])
def test_it_reports_every_figure(arguments):
    result = CliRunner().invoke(ardrone, ["--count", "10", "--rounds", "1", *arguments])
    assert result.exception is None, result.output
    if arguments:
        times = json.loads(result.output)["times"]
        assert all(row is None or 0 < row["min_us"] <= row["median_us"] for row in times.values())
        assert times["navdata: packet and all options"] and "peer: pyardrone, all options" in times
    else:
        assert "limit for packet and all options: 60 us" in result.output
