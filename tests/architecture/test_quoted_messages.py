"""Messages quoted on the first-flight page are those of the programs, word for word."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "how-to" / "first-flight-of-a-mavlink-vehicle.md"
SOURCES = [path.read_text() for package in ("groundstation", "drivers") for path in (ROOT / package).rglob("*.py")]
# Messages are sentences; other text in backquotes is input: commands, keys, names of parameters.
_TYPED = re.compile(r"^(groundstation|--|mavlink\.|sitl|PX4|MPC_|EKF2_|GUID_|COM_|RC)|^[A-Za-z_.0-9/-]+$")
# Filled in by a program: a name, a number, the rest of a sentence, or an addition after a semicolon.
_FILLED_IN = re.compile(r"\.\.\.|;|drone_\d|\d+%?|px4")


def quoted(page: str) -> list[str]:
    return [text for text in re.findall(r"`([^`]+)`", page) if not _TYPED.match(text)]


def unsaid(text: str, sources: list[str]) -> bool:
    """Return whether no source has the fixed words of a message, in order within a few lines."""
    words = [re.escape(part.strip(" ,:;")) for part in _FILLED_IN.split(text)]
    said = re.compile(r".{0,200}?".join(word for word in words if word), re.DOTALL)
    return not any(said.search(source) for source in sources)


def test_every_message_on_the_page_is_one_of_the_programs() -> None:
    messages = quoted(PAGE.read_text())
    assert len(messages) >= 15
    assert [text for text in messages if unsaid(text, SOURCES)] == []


def test_a_message_that_nobody_says_is_found() -> None:
    assert unsaid("waiting for its heart to beat", SOURCES)
    assert unsaid("drone_2: all parameters as wanted", SOURCES)
    assert not unsaid("drone_2: all parameters as needed", SOURCES)
