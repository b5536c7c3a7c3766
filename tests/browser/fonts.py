"""Smallest font sizes of a page: in visible text and in text drawn on a canvas."""

from typing import Any

LEAST_PX = 14.0
# To be run before the page's own scripts: records the size of each text drawn on a canvas, in pixels of the page.
REMEMBER = """(() => { window.__drawn = {}; const draw = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (words, ...place) {
    const size = parseFloat(this.font.match(/([\\d.]+)px/)[1]);
    window.__drawn[`${this.canvas.id || this.canvas.className || "picture"} ${words}`] = size;
    return draw.call(this, words, ...place);
  }; })()"""

# "Skip to the commands" waits outside of the page; a list's options are the browser's own.
_MEASURE = """(least) => { const found = new Set();
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const words = texts.currentNode.textContent.trim(), holder = texts.currentNode.parentElement;
    if (!words || holder.closest(".skip, option") || !holder.checkVisibility({visibilityProperty: true})) continue;
    const size = parseFloat(getComputedStyle(holder).fontSize);
    if (size < least) found.add(`${size} px: ${words}`);
  }
  for (const [words, size] of Object.entries(window.__drawn ?? {})) if (size < least) found.add(`${size} px: ${words}`);
  return [...found]; }"""


def small(page: Any, least_px: float = LEAST_PX) -> list[str]:
    """Return each visible text below the least size [px], after its size."""
    return list(page.evaluate(_MEASURE, least_px))
