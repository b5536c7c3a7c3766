"""Converts lens calibrations of ROS, OpenCV and Kalibr into ours."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from groundstation.errors import SettingsError
from groundstation.settings.document import Node, read
from groundstation.settings.wording import problem

# Names of our model in these programs: k1 k2 p1 p2 k3, further coefficients 0.
_OUR_MODEL = ("plumb_bob", "radtan", "radial-tangential", "rational_polynomial")
_REMEDY = "measure this lens with `groundstation calibrate camera`"


class _Keys(NamedTuple):
    """Keys of a program's file; "" for figures that it lacks."""

    matrix: str
    distortion: str
    size: tuple[str, ...]
    """Width and height, or one list of both."""
    model: str = ""
    residual: str = ""


_KNOWN = (
    _Keys(
        "camera_matrix",
        "distortion_coefficients",
        ("image_width", "image_height"),
        "distortion_model",
        "avg_reprojection_error",
    ),
    _Keys(
        "Camera_Matrix",
        "Distortion_Coefficients",
        ("image_Width", "image_Height"),
        residual="Avg_Reprojection_Error",
    ),
    _Keys("intrinsics", "distortion_coeffs", ("resolution",), "distortion_model"),
    _Keys("intrinsics", "distortion_coefficients", ("resolution",), "distortion_model"),  # of the EuRoC data sets
    # Messages `camera_info` as `ros2 topic echo` and `rostopic echo` print them.
    _Keys("k", "d", ("width", "height"), "distortion_model"),
    _Keys("K", "D", ("width", "height"), "distortion_model"),
)


def read_calibration(path: Path, name: str = "", named_in: Path | None = None) -> Node:
    """Return the content of any program's calibration file with our keys; raises SettingsError as `read` does."""
    return _ours(read(path, name, named_in))


def _ours(tree: Node) -> Node:
    """Return a calibration with our keys; raises SettingsError for a foreign one that cannot be converted."""
    if isinstance(tree.value, str) and tree.value.startswith("<?xml"):
        raise _refused(tree, f"is XML: let OpenCV write it as YAML (a name that ends in .yml), or {_REMEDY}")
    tree = _only_camera(tree)
    known = [keys for keys in _KNOWN if tree.get(keys.matrix) is not None]
    if not known:
        return tree
    return _translated(tree, next((keys for keys in known if tree.get(keys.distortion) is not None), known[0]))


def _only_camera(tree: Node) -> Node:
    """Return the one camera of a Kalibr chain; the tree itself, if it is none."""
    if not isinstance(tree.value, dict):
        return tree
    cameras = {name: node for name, node in tree.value.items() if node.get("intrinsics") is not None}
    if len(cameras) > 1:
        raise _refused(tree, f"holds {len(cameras)} cameras ({', '.join(cameras)}): a file for each is needed")
    return next(iter(cameras.values()), tree)


def _translated(tree: Node, keys: _Keys) -> Node:
    needed = (keys.distortion, *keys.size)
    if missing := [key for key in needed if tree.get(key) is None]:
        raise _refused(tree, f"a calibration of another program that lacks {', '.join(missing)}: {_REMEDY}")
    entries = {
        "model": Node("plumb_bob", tree.origin),
        **dict(zip(("width_px", "height_px"), _size(tree, keys), strict=True)),
        **dict(zip(("fx_px", "fy_px", "cx_px", "cy_px"), _pinhole(tree, tree.value[keys.matrix]), strict=True)),
        "distortion": _distortion(tree, keys),
    }
    residual = tree.get(keys.residual)
    return Node(entries | ({"residual_px": residual} if residual is not None else {}), tree.origin)


def _size(tree: Node, keys: _Keys) -> list[Node]:
    for name in ("binning_x", "binning_y"):  # of `camera_info`: its size is that of the pictures before
        binning = tree.get(name)
        if binning is not None and binning.value not in (0, 1):
            raise _refused(binning, f"its pictures are reduced: {_REMEDY}")
    found = [node for key in keys.size for node in _items(tree.value[key])]
    if len(found) != 2:
        raise _refused(tree.value[keys.size[0]], "must be the width and the height of the pictures")
    return found


def _pinhole(tree: Node, matrix: Node) -> list[Node]:
    """Return fx, fy, cx, cy of a matrix of 3 by 3, or of the four numbers themselves."""
    camera_model = tree.get("camera_model")  # of Kalibr
    if camera_model is not None and camera_model.value not in ("pinhole", *_OUR_MODEL):
        raise _refused(camera_model, f"{camera_model.value} is no pinhole with distortion: {_REMEDY}")
    items = _items(matrix)
    if len(items) == 4:
        return items
    if len(items) != 9:
        raise _refused(matrix, "must hold 9 numbers")
    if any(items[place].value != value for place, value in ((1, 0), (3, 0), (6, 0), (7, 0), (8, 1))):
        raise _refused(matrix, f"must be fx 0 cx, 0 fy cy, 0 0 1: {_REMEDY}")
    return [items[place] for place in (0, 4, 2, 5)]


def _distortion(tree: Node, keys: _Keys) -> Node:
    """Return k1, k2, p1, p2, k3."""
    held = tree.value[keys.distortion]
    items = _items(held)
    _require_our_model(tree, keys, held, items)
    further = [item for item in items[5:] if item.value != 0]
    if len(items) < 4 or further:
        raise _refused(held, f"has {len(items)} coefficients, k1 k2 p1 p2 k3 are wanted: {_REMEDY}")
    zero = Node(0.0, held.origin)
    return Node([*items, zero][:5], held.origin)


def _require_our_model(tree: Node, keys: _Keys, held: Node, items: Sequence[Node]) -> None:
    """Refuse any other lens model: its coefficients would pass for ours, and all sightings would be wrong."""
    model = tree.get(keys.model)
    if model is not None and model.value not in _OUR_MODEL:
        raise _refused(model, f"{model.plain()} is another model of a lens than plumb_bob: {_REMEDY}")
    fisheye = tree.get("fisheye_model")  # of OpenCV's sample
    if fisheye is not None and fisheye.value:
        raise _refused(fisheye, f"a fisheye's is another model of a lens than plumb_bob: {_REMEDY}")
    if model is None and len(items) == 4:
        raise _refused(held, f"has 4 coefficients and no distortion_model, it may be a fisheye's: {_REMEDY}")


def _items(node: Node) -> list[Node]:
    """Return the numbers of a list, of lists in a list, of a matrix with its `data`, or of a single number."""
    data = node.get("data") or node
    return [inner for item in data.value for inner in _items(item)] if isinstance(data.value, list) else [data]


def _refused(node: Node, text: str) -> SettingsError:
    return SettingsError([problem(node.origin, text)])
