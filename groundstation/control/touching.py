"""The point nearest to a wanted one on the intersection of one, two or three planes. Pure."""

from groundstation.vectors import Vector3, cross, dot

Plane = tuple[Vector3, float]
"""A plane: its unit normal, and its distance from the origin along that."""

# The square of the area or volume that normals span, below which their planes count as parallel to a line.
_PARALLEL = 1e-12


def touching(wanted: Vector3, planes: tuple[Plane, ...]) -> Vector3 | None:
    """Return the point nearest to `wanted` on all of up to three planes.

    None if they do not meet in one plane, line or point, or if one of them does not hold `wanted` back: without that
    one a nearer point is allowed.
    """
    if len(planes) == 1:
        ((normal, most),) = planes
        pulls: tuple[float, ...] | None = (dot(normal, wanted) - most,)
    else:
        pulls = _two(wanted, *planes) if len(planes) == 2 else _three(wanted, *planes)
    if pulls is None or min(pulls) < 0.0:
        return None
    x, y, z = wanted
    for pull, ((nx, ny, nz), _) in zip(pulls, planes, strict=True):
        x, y, z = x - pull * nx, y - pull * ny, z - pull * nz
    return x, y, z


def _two(wanted: Vector3, first: Plane, second: Plane) -> tuple[float, ...] | None:
    """Return the components along both normals of the way to the line in which two planes meet."""
    (a, most_a), (b, most_b) = first, second
    line = cross(a, b)
    area = dot(line, line)
    if area < _PARALLEL:
        return None
    along, over_a, over_b = dot(a, b), dot(a, wanted) - most_a, dot(b, wanted) - most_b
    return (over_a - along * over_b) / area, (over_b - along * over_a) / area


def _three(wanted: Vector3, first: Plane, second: Plane, third: Plane) -> tuple[float, ...] | None:
    """Return the components along each normal of the way to the point in which three planes meet."""
    (a, most_a), (b, most_b), (c, most_c) = first, second, third
    bc, ca, ab = cross(b, c), cross(c, a), cross(a, b)
    volume = dot(a, bc)
    if volume * volume < _PARALLEL:
        return None
    over_a, over_b, over_c = dot(a, wanted) - most_a, dot(b, wanted) - most_b, dot(c, wanted) - most_c
    x, y, z = ((over_a * bc[i] + over_b * ca[i] + over_c * ab[i]) / volume for i in range(3))
    way = (x, y, z)
    return dot(way, bc) / volume, dot(way, ca) / volume, dot(way, ab) / volume
