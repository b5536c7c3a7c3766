"""The study's command line answers an operator's mistake in one line, without a traceback."""

import sys

import pytest

from sim_bridge.study.__main__ import main


@pytest.mark.parametrize(("text", "said"), [(None, "no such file"), ("windy: 1", "windy")])
def test_a_wrong_scenario_is_named(tmp_path, monkeypatch, capsys, text, said):
    path = tmp_path / "scenario.yaml"
    if text is not None:
        path.write_text(text)
    monkeypatch.setattr("sim_bridge.study.__main__.resolved_field", lambda *_: None)
    monkeypatch.setattr(sys, "argv", ["study", "demo", "--scenario", str(path)])
    assert main() == 2
    assert said in capsys.readouterr().err
