"""Positions of the page elements that must not move."""

from seen_page import Seen

# Elements to press in a hurry, and those looked at first.
FIXED = """() => Object.fromEntries(
    [...document.querySelectorAll(
      "#shell :is(button, dd), #team, #team article, #team :is(button, .pill, dd), main .map button, #map, #orders")]
    .filter((node) => node.dataset.testid && node.checkVisibility())
    .map((node) => [node.dataset.testid, node])
    .map(([name, node]) => { const {x, y, width, height} = node.getBoundingClientRect();
      return [name, node.matches("dd, .pill") ? [x, y] : [x, y, width, height]]; }))"""


def boxes(page: Seen) -> dict[str, list[float]]:
    """Return place and size of each element that must not move; of texts the start only."""
    return dict(page.page.evaluate(FIXED))


def moved(page: Seen, before: dict[str, list[float]]) -> dict[str, tuple[list[float], list[float] | None]]:
    """Return the elements that have moved; 0 px are allowed."""
    after = boxes(page)
    return {name: (box, after.get(name)) for name, box in before.items() if after.get(name) != box}
