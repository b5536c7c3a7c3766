"""`groundstation bench bus` times real round trips on both buses."""

import json

from click.testing import CliRunner

from groundstation.cli.bench_bus import bus


def test_it_reports_both_buses_and_their_ratio() -> None:
    result = CliRunner().invoke(bus, ["--trips", "20", "--json"])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.output
    figures = json.loads(result.output)
    assert 0 < figures["plain_p50_ms"] <= figures["plain_p99_ms"]
    assert 0 < figures["guarded_p50_ms"] <= figures["guarded_p99_ms"]
    assert figures["lost"] == 0
    assert figures["passed"] is (figures["ratio_p50"] <= 1.3)
