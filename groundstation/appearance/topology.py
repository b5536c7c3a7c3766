"""A sensing topology in words."""

NOBODY = "nobody in the air"


def topology_words(text: str) -> str:
    """Return a topology's text form `a,b/c` as it is shown: "a + b over c"; `NOBODY` for the empty one."""
    return " over ".join(level.replace(",", " + ") for level in text.split("/")) or NOBODY
