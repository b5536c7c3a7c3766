"""Measures which text of a page is clipped or covered, over all elements."""

from typing import Any

# Lists that scroll, whose whole content is in reach of wheel, finger and keyboard. Elsewhere, text that does not fit is
# clipped. "Skip to the commands" waits outside of the page until it has the focus.
SCROLLS = ("#orders", "#events", "#alarm-log")
OUT_OF_SIGHT = (".skip", "option", "body.wall .brand", "#playback[hidden]")

# Each line of each text against every ancestor that clips it, and against the page's width. The measured box of a font
# is a few pixels higher than its letters.
_MEASURE = """([scrolls, hidden]) => {
  const SIDE_PX = 1, FONT_BOX_PX = 3, found = new Set();
  const clips = (node) => { const {overflowX, overflowY} = getComputedStyle(node);
    return overflowX !== "visible" || overflowY !== "visible"; };
  const inside = (line, box) => line.left >= box.left - SIDE_PX && line.right <= box.right + SIDE_PX
    && line.top >= box.top - FONT_BOX_PX && line.bottom <= box.bottom + FONT_BOX_PX;
  const page = {left: 0, right: document.documentElement.clientWidth, top: -Infinity, bottom: Infinity};
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const text = texts.currentNode, holder = text.parentElement;
    if (!text.textContent.trim() || !holder.checkVisibility({visibilityProperty: true})) continue;
    if (hidden.some((of) => holder.closest(of))) continue;
    const range = document.createRange();
    range.selectNodeContents(text);
    const lines = [...range.getClientRects()].filter(({width}) => width > 0);
    const tell = (where) => found.add(`${where}: ${text.textContent.trim()}`);
    if (lines.some((line) => !inside(line, page))) tell("page");
    for (let over = holder; over !== document.body; over = over.parentElement) {
      if (scrolls.some((of) => over.matches(of))) break;
      if (!clips(over)) continue;
      const box = over.getBoundingClientRect(), name = over.id || over.className || over.tagName;
      if (lines.some((line) => !inside(line, box))) { tell(name); break; }
      if (over.scrollWidth > over.clientWidth + SIDE_PX || over.scrollHeight > over.clientHeight + FONT_BOX_PX) {
        tell(`${name} scrolls`); break; }
    }
  }
  return [...found]; }"""

_COVERED = """() => { const found = [];
  for (const part of ["#shell", "main .map", "#team"]) {
    const pressed = document.querySelectorAll(`${part} :is(button, summary)`);
    const seen = (one) => one.checkVisibility() && !(part === "#shell" && one.closest(".stops"));
    const buttons = [...pressed].filter(seen);
    buttons.forEach((one, index) => { const a = one.getBoundingClientRect();
      for (const other of buttons.slice(index + 1)) { const b = other.getBoundingClientRect();
        if (a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom)
          found.push(`${one.textContent} covers ${other.textContent}`); } });
    const texts = document.createTreeWalker(document.querySelector(part), NodeFilter.SHOW_TEXT);
    while (texts.nextNode()) {
      const text = texts.currentNode, holder = text.parentElement, range = document.createRange();
      if (!text.textContent.trim() || holder.closest("button, summary, .sheet") || !holder.checkVisibility()) continue;
      range.selectNodeContents(text);
      for (const line of range.getClientRects()) for (const one of buttons) { const box = one.getBoundingClientRect();
        if (line.left < box.right - 1 && box.left < line.right - 1
          && line.top < box.bottom - 3 && box.top < line.bottom - 3)
          found.push(`${one.textContent} covers ${text.textContent.trim()}`); }
    }
  }
  return found; }"""


def clipped(page: Any) -> list[str]:
    """Return each visible text that is clipped, after the name of the element that clips it."""
    return list(page.evaluate(_MEASURE, [SCROLLS, OUT_OF_SIGHT]))


# Words of a button that overflow it by more than a font's box: without clipping they overlap others.
_OVERHANG = """() => [...document.querySelectorAll("button")].filter((one) => one.checkVisibility()).filter((one) => {
  const words = document.createRange(), box = one.getBoundingClientRect();
  words.selectNodeContents(one);
  return [...words.getClientRects()].some(({left, right, top, bottom, width}) => width > 0
    && (left < box.left || right > box.right || top < box.top - 3 || bottom > box.bottom + 3));
}).map((one) => `out of its button: ${one.innerText}`)"""


def overhanging(page: Any) -> list[str]:
    """Return each button whose words do not fit into it."""
    return list(page.evaluate(_OVERHANG))


def covered(page: Any) -> list[str]:
    """Return the other buttons and words that a button covers in its part of the page."""
    return list(page.evaluate(_COVERED))
