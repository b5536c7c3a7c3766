"""Texts of others without a terminal's control characters.

Names of members, and texts of devices and recordings, may hold sequences that clear a terminal's lines or forge them.
"""

_CONTROLS = {*range(0x20), *range(0x7F, 0xA0)}
_SHOWN = "\N{REPLACEMENT CHARACTER}"
_LINES = dict.fromkeys(_CONTROLS - {*b"\n\t"}, _SHOWN)
_ONE_LINE = dict.fromkeys(_CONTROLS, _SHOWN)


def plain(text: str) -> str:
    """Return a text of the same length, without control characters but line ends and tabs."""
    return text.translate(_LINES)


def one_line(text: str) -> str:
    """Return a text of the same length, without control characters."""
    return text.translate(_ONE_LINE)
