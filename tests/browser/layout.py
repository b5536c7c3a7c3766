"""Whether a page is shown whole, at a size of its window."""

from clipping import clipped, covered, overhanging
from fonts import small
from seen_page import Seen


def resize(page: Seen, size: tuple[int, int]) -> None:
    page.page.set_viewport_size({"width": size[0], "height": size[1]})
    page.page.wait_for_timeout(300)  # until the page has chosen the texts that fit


def whole(page: Seen) -> list[str]:
    """Return the faults of the page's layout: clipped, covered, too small, or wider than the window."""
    wide = page.page.evaluate(
        "() => document.documentElement.scrollWidth > innerWidth ? ['wider than the window'] : []"
    )
    return [*clipped(page.page), *overhanging(page.page), *covered(page.page), *small(page.page), *wide]
