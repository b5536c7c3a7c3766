"""Pages with markers to cut out, and a page that says how to check and mount them."""

from dataclasses import dataclass

from groundstation.geometry import board
from groundstation.geometry.tag import QUIET_MODULES, SquareTag
from groundstation.printing.pdf import Page

# Width and height [mm], upright.
PAPERS = {
    "A5": (148.0, 210.0),
    "A4": (210.0, 297.0),
    "A3": (297.0, 420.0),
    "A2": (420.0, 594.0),
    "A1": (594.0, 841.0),
    "A0": (841.0, 1189.0),
    "Letter": (215.9, 279.4),
    "Tabloid": (279.4, 431.8),
}
# Printers leave this much of the paper white at its edges.
_UNPRINTABLE_MM = 5.0
_MARK_MM, _MARK_GAP_MM = 5.0, 1.0
_RULER_MM = 100.0
_LEADING = 1.6

Rectangle = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Sheet:
    """Content of one page about the marker's origin [mm; x right, y up]: rectangles x0 x1 y0 y1."""

    label: str
    check: str
    card: Rectangle
    black: tuple[Rectangle, ...]


def checkerboard(code: int, square_mm: float) -> Sheet:
    """Return the print of one checkerboard; raises ValueError for a code or a size that cannot be."""
    marker = board.Checkerboard(code, square_mm)
    black = tuple(_scaled(r, square_mm) for r in _joined(board.dark_rectangles(marker.code)))
    label = f"marker {code} - square {square_mm:g} mm, five {board.SQUARES_X * square_mm:.1f} mm - bar forward >"
    check = f"marker {code}: the row of five squares must measure {board.SQUARES_X * square_mm:.1f} mm"
    return Sheet(label, check, _scaled(board.EXTENT, square_mm), black)


def tag(marker: SquareTag, black_cells: list[list[bool]]) -> Sheet:
    """Return the print of one tag; black_cells: its modules by rows from the top, border included."""
    side, half = marker.size_mm / marker.modules, marker.size_mm / 2
    black = []
    for row, cells in enumerate(black_cells):
        top = half - row * side
        start = 0
        for column in range(1, len(cells) + 1):
            if column == len(cells) or cells[column] != cells[start]:
                if cells[start]:
                    black.append((start * side - half, column * side - half, top - side, top))
                start = column
    edge = half + QUIET_MODULES * side
    label = f"{marker.dictionary} id {marker.id} - {marker.size_mm:g} mm - forward >"
    check = f"{marker.dictionary} id {marker.id}: the side of the black square must measure {marker.size_mm:.1f} mm"
    return Sheet(label, check, (-edge, edge, -edge, edge), tuple(black))


def page(item: Sheet, paper: tuple[float, float]) -> Page:
    """Return a page with a marker in its middle, upright or sideways; raises ValueError when it does not fit."""
    width, height = _size(item.card)
    ways = [way for way in (paper, paper[::-1]) if _fits(item, way)]
    if not ways:
        raise ValueError(
            f"needs a card of {width:.0f} mm x {height:.0f} mm, which does not fit on {paper[0]:g} mm x {paper[1]:g} mm"
        )
    sheet = Page(*ways[0])
    x0, x1, y0, y1 = item.card
    # Place of the marker's origin that centres its card on the page.
    at = ((sheet.width_mm - x0 - x1) / 2, (sheet.height_mm - y0 - y1) / 2)
    for left, right, low, high in item.black:
        sheet.rectangle(at[0] + left, at[1] + low, right - left, high - low)
    _cutting_marks(sheet, at[0] + x0, at[1] + y0, at[0] + x1, at[1] + y1)
    inner = min(low for _, _, low, _ in item.black)
    size = min(2.4, 0.25 * (inner - y0))
    edge = max(at[1] + y0 + 0.1 * (inner - y0), min(_UNPRINTABLE_MM, at[1] + inner - 2 * size))
    sheet.text(at[0] + min(left for left, _, _, _ in item.black), edge, item.label, size, 0.35)
    return sheet


def largest(size_mm: float, item: Sheet, paper: tuple[float, float]) -> float:
    """Return the largest size [whole mm] of the same kind that fits, given one print and its size."""
    for size in range(int(size_mm), 0, -1):
        scale = size / size_mm
        smaller = Sheet("", "", _scaled(item.card, scale), tuple(_scaled(r, scale) for r in item.black))
        if any(_fits(smaller, way) for way in (paper, paper[::-1])):
            return float(size)
    return 0.0


def notes(items: list[Sheet], paper: tuple[float, float]) -> Page:
    """Return the page to read first: how to check the scale, cut out and mount."""
    sheet = Page(*paper)
    line = [paper[1] - 22.0]
    size = 3.6 if paper[0] >= 200 else 2.4

    def say(words: str, height: float = size) -> None:
        sheet.text(14.0, line[0], words, height)
        line[0] -= _LEADING * height

    say("Skein markers: check, cut out, mount", 1.5 * size)
    line[0] -= 4.0
    for words in _NOTES:
        say(words)
    line[0] -= 8.0
    _ruler(sheet, 14.0, line[0])
    line[0] -= 16.0
    for item in items[: max(1, int((line[0] - 10.0) / (_LEADING * size)))]:
        say(item.check)
    return sheet


_NOTES = (
    '1. Print at 100 % (no "fit to page"), black on matt white paper; gloss blinds cameras.',
    "2. Put a ruler to the scale below and to each marker (lengths at the end of this page).",
    "    If they differ, measure what was printed and set that: marker.square_mm or marker.size_mm.",
    "3. Cut along the corner marks. An edge without marks is the edge of the paper.",
    "    The white margin belongs to the marker: without it the detector refuses it.",
    "4. Glue it flat on something stiff: a bend of 1 mm is seen. Nothing may cover it.",
    "5. Face up on top of the vehicle. Forward (the nose, +x of the vehicle) is where the label's",
    "    arrow points: on checkerboards the end with the bar of eight cells, on tags the right edge.",
    "6. Measure from the vehicle's centre to the marker's centre: marker.position_m, or height_m of a target.",
    "    The centre of a checkerboard is that of its squares; the bar does not count.",
    "7. A mirrored print, and two markers with one identity, are refused.",
)


def _ruler(sheet: Page, x: float, y: float) -> None:
    sheet.line(x, y, x + _RULER_MM, y, 0.2)
    for step in range(11):
        length = 5.0 if step % 5 == 0 else 3.0
        sheet.line(x + 10.0 * step, y, x + 10.0 * step, y + length, 0.2)
    sheet.text(x + _RULER_MM + 3.0, y, "100 mm", 3.0)


def _cutting_marks(sheet: Page, left: float, low: float, right: float, high: float) -> None:
    for x, outward_x in ((left, -1.0), (right, 1.0)):
        for y, outward_y in ((low, -1.0), (high, 1.0)):
            sheet.line(x + outward_x * _MARK_GAP_MM, y, x + outward_x * (_MARK_GAP_MM + _MARK_MM), y)
            sheet.line(x, y + outward_y * _MARK_GAP_MM, x, y + outward_y * (_MARK_GAP_MM + _MARK_MM))


def _fits(item: Sheet, way: tuple[float, float]) -> bool:
    """Return whether the card fits on the paper with nothing black in the margins that printers leave white."""
    width, height = _size(item.card)
    if width > way[0] + 0.05 or height > way[1] + 0.05:
        return False
    x0, x1, y0, y1 = item.card
    centre_x, centre_y = (x0 + x1) / 2, (y0 + y1) / 2
    reach_x = max(max(centre_x - left, right - centre_x) for left, right, _, _ in item.black)
    reach_y = max(max(centre_y - low, high - centre_y) for _, _, low, high in item.black)
    return reach_x <= way[0] / 2 - _UNPRINTABLE_MM and reach_y <= way[1] / 2 - _UNPRINTABLE_MM


def _size(card: Rectangle) -> tuple[float, float]:
    return card[1] - card[0], card[3] - card[2]


def _scaled(rectangle: Rectangle, by: float) -> Rectangle:
    x0, x1, y0, y1 = rectangle
    return x0 * by, x1 * by, y0 * by, y1 * by


def _joined(rectangles: list[Rectangle]) -> list[Rectangle]:
    """Return the same area with rectangles that share a full side merged, so that no hairlines show."""
    joined: list[Rectangle] = []
    for x0, x1, y0, y1 in sorted(rectangles):
        if joined and joined[-1][:2] == (x0, x1) and abs(joined[-1][3] - y0) < 1e-9:
            joined[-1] = (x0, x1, joined[-1][2], y1)
        else:
            joined.append((x0, x1, y0, y1))
    return joined
