"""Why a camera that is connected shows nothing, by what was refused since its last good picture. Pure."""

from collections import Counter

_KEY_PICTURE = "came, but no key picture to begin with: set a shorter key interval in the camera"
_REASONS = {
    "before_key_picture": _KEY_PICTURE,
    "after_lost_picture": _KEY_PICTURE,
    "held_back": "came that the link had held back: improve the link, or lower rate or size of the pictures",
}
_UNDECODABLE = "came that cannot be decoded"
# Counts of data that are no pictures, and of pictures that were decoded all the same.
_OTHERS = frozenset({"bytes", "pave_bytes", "second publisher", "detector", "size"})


def why_silent(refused: Counter[str]) -> str:
    """Return the commonest reason in words; refused: how many were, by the drivers' and readers' names of reasons."""
    known = Counter[str]()
    for reason, count in refused.items():
        if reason not in _OTHERS:
            known[_REASONS.get(reason, _UNDECODABLE)] += max(0, count)
    ((words, count),) = known.most_common(1) or [("", 0)]
    return f"{count} {words}" if count else "connected, but nothing comes"
