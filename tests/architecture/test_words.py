"""Words that the glossary has replaced do not come back."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TEXTS = sorted(
    path
    for top in ("groundstation", "drivers", "sim_bridge", "docs", "tests", "config")
    for path in (ROOT / top).rglob("*")
    if path.suffix in {".py", ".md", ".yaml", ".js", ".html"} and path != Path(__file__)
)
REPLACED = {"setpoint": r"set-point", "level height": r"(height|level) slots?\b|\bslots\("}


@pytest.mark.parametrize("word", REPLACED)
def test_a_replaced_word_does_not_come_back(word: str) -> None:
    old = re.compile(REPLACED[word], re.IGNORECASE)
    found = [f"{path.relative_to(ROOT)}: {word}" for path in TEXTS if old.search(path.read_text(encoding="utf-8"))]
    assert not found, "\n".join(found)
