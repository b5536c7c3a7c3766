"""The import graph as a picture (SVG): each package stands above all that it imports."""

from html import escape
from itertools import pairwise

from skein_reference.import_graph import Graph, import_graph, layers, reduced

_ROW_PX, _BOX_PX, _GAP_PX, _MARGIN_PX, _CHARACTER_PX = 66, 26, 18, 16, 7.2
_FILLS = {"groundstation": "#dbe9f6", "drivers": "#dff0d8", "sim_bridge": "#fbe5c8"}
_SWEEPS = 12
_BEND = "->"  # in the name of a place where a long arrow passes a row

Box = tuple[float, float, float]  # left, top, width [px]


def import_picture() -> str:
    """Return the picture; the same sources give the same text."""
    graph = import_graph()
    rows = layers(graph)
    ways = _ways(rows, reduced(graph))
    _untangle(rows, ways)
    boxes = _boxes(rows)
    width = max(left + size for left, _, size in boxes.values()) + _MARGIN_PX
    height = len(rows) * _ROW_PX
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height}" width="{width:.0f}" '
            f'height="{height}" font-family="sans-serif" font-size="12">',
            '<rect width="100%" height="100%" fill="#ffffff"/>',
            *(_arrow([boxes[node] for node in way]) for way in ways),
            *(_labelled(node, boxes[node]) for node in sorted(graph)),
            "</svg>\n",
        ]
    )


def _ways(rows: list[list[str]], arrows: Graph) -> list[list[str]]:
    """Return each arrow as the places that it passes, from the top; a place for each row between is put into it."""
    row_of = {node: number for number, row in enumerate(rows) for node in row}
    ways = []
    for node in sorted(arrows):
        for other in sorted(arrows[node]):
            between = range(row_of[node] - 1, row_of[other], -1)
            bends = {number: f"{node}{_BEND}{other}{_BEND}{number}" for number in between}
            for number, bend in bends.items():
                rows[number].append(bend)
            ways.append([node, *bends.values(), other])
    return ways


def _untangle(rows: list[list[str]], ways: list[list[str]]) -> None:
    """Order each row by where its neighbours stand, so that few arrows cross."""
    neighbours: dict[str, list[str]] = {node: [] for row in rows for node in row}
    for way in ways:
        for upper, lower in pairwise(way):
            neighbours[upper].append(lower)
            neighbours[lower].append(upper)
    for _ in range(_SWEEPS):
        for row in rows:
            place = {node: (number + 0.5) / len(one) for one in rows for number, node in enumerate(one)}
            row.sort(key=lambda node: (_mean([place[other] for other in neighbours[node]], place[node]), node))


def _mean(values: list[float], otherwise: float) -> float:
    return sum(values) / len(values) if values else otherwise


def _boxes(rows: list[list[str]]) -> dict[str, Box]:
    widths = [[0.0 if _BEND in node else len(_label(node)) * _CHARACTER_PX + 20 for node in row] for row in rows]
    lengths = [sum(sizes) + _GAP_PX * (len(sizes) - 1) for sizes in widths]
    boxes = {}
    for number, (row, sizes) in enumerate(zip(rows, widths, strict=True)):
        spare = (max(lengths) - lengths[number]) / (len(row) + 1)
        left = _MARGIN_PX + spare
        top = (len(rows) - 1 - number) * _ROW_PX + (_ROW_PX - _BOX_PX) / 2
        for node, size in zip(row, sizes, strict=True):
            boxes[node] = (left, top, size)
            left += size + _GAP_PX + spare
    return boxes


def _label(node: str) -> str:
    return node.removeprefix("groundstation.")


def _labelled(node: str, box: Box) -> str:
    left, top, width = box
    fill = _FILLS[node.partition(".")[0]]
    return (
        f'<rect x="{left:.1f}" y="{top:.1f}" width="{width:.1f}" height="{_BOX_PX}" rx="4" fill="{fill}" '
        f'stroke="#555555"/><text x="{left + width / 2:.1f}" y="{top + _BOX_PX / 2 + 4:.1f}" '
        f'text-anchor="middle">{escape(_label(node))}</text>'
    )


def _arrow(way: list[Box]) -> str:
    x, y = way[0][0] + way[0][2] / 2, way[0][1] + _BOX_PX
    path = f"M{x:.1f},{y:.1f}"
    for left, top, width in way[1:]:
        next_x, bend = left + width / 2, (top - y) / 2
        path += f" C{x:.1f},{y + bend:.1f} {next_x:.1f},{top - bend:.1f} {next_x:.1f},{top:.1f}"
        x, y = next_x, top
        if (left, top, width) != way[-1]:
            y += _BOX_PX
            path += f" L{x:.1f},{y:.1f}"
    tip = f"M{x - 4:.1f},{y - 7:.1f} L{x + 4:.1f},{y - 7:.1f} L{x:.1f},{y:.1f} Z"
    return f'<path d="{path}" fill="none" stroke="#8a8a8a"/><path d="{tip}" fill="#8a8a8a"/>'
