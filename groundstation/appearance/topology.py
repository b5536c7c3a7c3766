"""A sensing topology in words."""

NOBODY = "nobody in the air"


def topology_words(text: str) -> str:
    """Return the words for a topology's text form: "a + b over c" for `a,b/c`; `NOBODY` for the empty one."""
    return " over ".join(level.replace(",", " + ") for level in text.split("/")) or NOBODY
