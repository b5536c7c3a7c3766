"""The search for boards in a whole picture: saddle points in lattice-like clusters.

Inner corners of a checkerboard are saddle points of brightness, and direct neighbours are turned by 90 degrees against
each other, a pattern that carpets, cables and furniture seldom show. Only the best clusters go to the slow board
finder.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera.detect import Find, Window, card_outline, enlargement, find_board, window_around
from groundstation.arrays import Array, Image
from groundstation.geometry import board as marker

HALVE_ABOVE_PX = 800
"""Width [px] above which a picture is halved before it is searched."""
_SMOOTHING_PX = 1.2
_MOST_SEEDS = 220
_LEAST_STRENGTH = 250.0
# Inner corners of one board are equally strong; the ends of its black squares have less than half that strength.
_REACH = 2.1
_LEAST_CLUSTER, _MOST_CLUSTER = 6, 40
_MOST_WINDOWS = 4
_MARGIN_SQUARES = 2.6
# Up to this size the board finder is cheaper than a search for saddle points in the same window [px, enlarged].
_MOST_ENLARGED_PX = 150_000


@dataclass(frozen=True, slots=True)
class Seeds:
    """Saddle points: positions (n, 2) [px], strengths (n), double-angle directions (n, 2)."""

    points: Array
    strength: Array
    direction: Array


@dataclass(frozen=True, slots=True)
class Cluster:
    """Saddle points (n, 2) [px] that may be one board's corners, and the side of its squares [px]."""

    points: Array
    spacing: float


def find_in(picture: Image, window: Window, spacing: float, others: list[Array]) -> Find | None:
    """Return a board in the window that is none of the `others` (corners of each), or None.

    A window too wide to be enlarged as a whole is searched for saddle points first.
    """
    picture = _without(picture, window, others)
    width, height = window.right - window.left, window.bottom - window.top
    if width * height * enlargement(spacing) ** 2 <= _MOST_ENLARGED_PX:
        return find_board(picture, window, spacing)
    part = np.ascontiguousarray(picture[window.top : window.bottom, window.left : window.right])
    finds = search(part, [], 2)
    if not finds:
        return None
    return Find(finds[0].corners + np.array([window.left, window.top]), finds[0].white, finds[0].black)


def _without(picture: Image, window: Window, others: list[Array]) -> Image:
    """Return a picture in which other boards that reach into the window are painted over."""
    outlines = [card_outline(corners) for corners in others]
    near = [
        outline
        for outline in outlines
        if (outline.max(axis=0) >= (window.left, window.top)).all()
        and (outline.min(axis=0) <= (window.right, window.bottom)).all()
    ]
    if not near:
        return picture
    painted = picture.copy()
    for outline in near:
        cv2.fillConvexPoly(painted, np.rint(outline).astype(np.int32), 128)
    return painted


def search(picture: Image, taken: list[Window], most: int = _MOST_WINDOWS) -> list[Find]:
    """Return the boards in the whole picture outside the windows already taken; tries at most `most` clusters."""
    finds: list[Find] = []
    for cluster in clusters(saddle_points(picture), taken)[:most]:
        window = window_around(cluster.points, _MARGIN_SQUARES * cluster.spacing, picture.shape)
        find = find_board(picture, window, cluster.spacing) if window else None
        if find is not None and all(np.hypot(*(find.centre - other.centre)) > cluster.spacing for other in finds):
            finds.append(find)
    return finds


def saddle_points(picture: Image) -> Seeds:
    """Return the strongest saddle points of a picture; large pictures are halved first."""
    factor = 2 if picture.shape[1] > HALVE_ABOVE_PX else 1
    if factor == 2:
        picture = np.asarray(
            cv2.resize(picture, (picture.shape[1] // 2, picture.shape[0] // 2), interpolation=cv2.INTER_AREA), np.uint8
        )
    smooth = cv2.GaussianBlur(picture, (0, 0), _SMOOTHING_PX)
    xx, yy, xy = (cv2.Sobel(smooth, cv2.CV_32F, dx, dy, ksize=3) for dx, dy in ((2, 0), (0, 2), (1, 1)))
    strength = xy * xy
    strength -= xx * yy
    around = cv2.dilate(strength, np.ones((3, 3), np.uint8))
    strong = np.flatnonzero(strength > _LEAST_STRENGTH)
    peak = strong[strength.ravel()[strong] >= around.ravel()[strong]]
    rows, columns = np.divmod(peak, strength.shape[1])
    a, b, c, s = (image.ravel()[peak].astype(np.float64) for image in (xx, yy, xy, strength))
    # Opposite curvatures of similar size; an edge has only one.
    keep = np.flatnonzero((a + b) ** 2 < 1.4 * s)
    keep = keep[np.argsort(-s[keep])[:_MOST_SEEDS]]
    direction = np.column_stack((a - b, 2.0 * c))[keep]
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-9)
    points = np.column_stack((columns, rows))[keep].astype(np.float64) * factor + 0.5 * (factor - 1)
    return Seeds(points, s[keep], direction)


def clusters(seeds: Seeds, taken: list[Window]) -> list[Cluster]:
    """Return lattice-like clusters of saddle points, the likeliest board first."""
    free = np.ones(len(seeds.points), dtype=bool)
    for left, top, right, bottom in taken:
        x, y = seeds.points.T
        free &= ~((left <= x) & (x < right) & (top <= y) & (y < bottom))
    points, strength, direction = seeds.points[free], seeds.strength[free], seeds.direction[free]
    if len(points) < _LEAST_CLUSTER:
        return []
    across, along = (points[:, None, axis] - points[None, :, axis] for axis in (0, 1))
    distance = np.sqrt(across * across + along * along)
    ratio = strength[:, None] / strength[None]
    opposite = (direction @ direction.T < -0.6) & (ratio > 0.55) & (ratio < 1.8)
    reach = np.where(opposite, distance, np.inf).min(axis=1)
    similar = (reach[:, None] < 2.0 * reach[None]) & (reach[None] < 2.0 * reach[:, None])
    linked = opposite & similar & (distance < _REACH * np.minimum(reach[:, None], reach[None]))
    label = _components(linked)
    names, counts = np.unique(label, return_counts=True)
    members = [label == k for k in names[(counts >= _LEAST_CLUSTER) & (counts <= _MOST_CLUSTER)]]
    found = [_rated(points[own], reach[own], linked[own]) for own in members]
    best = sorted((pair for pair in found if pair is not None), key=lambda pair: pair[0])
    return [cluster for _, cluster in best]


def _components(linked: NDArray[np.bool_]) -> NDArray[np.intp]:
    label = np.arange(len(linked))
    reachable = linked | np.eye(len(linked), dtype=bool)
    for _ in range(len(linked)):
        lowest = np.where(reachable, label[None], len(linked)).min(axis=1)
        if (lowest == label).all():
            break
        label = lowest
    return label


def _rated(points: Array, reach: Array, linked: NDArray[np.bool_]) -> tuple[float, Cluster] | None:
    """Return how unlike a board a cluster is, and the cluster; None when it cannot be one."""
    count = len(points)
    spacing = float(np.median(reach))
    if np.ptp(points, axis=0).max() > 9.0 * spacing * 2.0:
        return None
    # Seventeen links join the twelve corners of a 4 x 3 lattice: 34 ends, 2.8 for each corner.
    links = float(linked.sum()) / count
    return abs(count - marker.CORNERS) / marker.CORNERS + abs(links - 2.8) / 2.8, Cluster(points, spacing)
