"""The commands in CONTRIBUTING.md run the same checks as the Makefile and `.ci/run`."""

import re
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

ROOT = Path(__file__).parents[2]


def yaml(name: str) -> Any:
    return YAML(typ="safe").load(ROOT / name)


def test_hooks_run_what_make_check_runs() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    recipe = re.search(r"^check:.*\n((?:\t.*\n)+)", makefile, re.M)
    assert recipe
    checks = {line.split()[0].replace("$(BIN)", ".venv/bin") for line in recipe[1].splitlines()}
    (local,) = yaml(".pre-commit-config.yaml")["repos"]
    assert local["repo"] == "local"
    assert {hook["entry"].split()[0] for hook in local["hooks"] if hook["language"] == "system"} == checks


def test_a_long_subject_is_refused_and_a_long_body_is_not() -> None:
    (hook,) = (each for each in yaml(".pre-commit-config.yaml")["repos"][0]["hooks"] if each["id"] == "subject")
    assert "--multiline" in hook["args"]
    assert re.search(hook["entry"], "x" * 73 + "\n")
    assert not re.search(hook["entry"], "x" * 72 + "\n\n" + "y" * 100)


def test_the_workflow_calls_our_own_run() -> None:
    steps = yaml(".github/workflows/ci.yml")["jobs"]["run"]["steps"]
    assert steps[-1] == {"run": ".ci/run"}
