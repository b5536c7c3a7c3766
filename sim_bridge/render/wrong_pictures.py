"""Wrong pictures that arrive: frozen, black, of a turned camera, with exchanged boards."""

from collections.abc import Iterable
from dataclasses import replace

from groundstation.arrays import Array, Image
from groundstation.geometry.pose import Pose
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.mounting import turned_about
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.spec import BoardSpec, RenderSpec

_SCENE = frozenset({FaultKind.CAMERA_BUMPED, FaultKind.WRONG_BOARD})


def spec_under(spec: RenderSpec, faults: Iterable[Fault]) -> RenderSpec:
    """Return the spec of a camera under faults of its mounting and of boards."""
    for fault in faults:
        if fault.kind is FaultKind.CAMERA_BUMPED:
            pose = spec.mount.parent_from_optical
            turned = Pose(pose.rotation @ turned_about(fault.amount, fault.direction_deg), pose.translation)
            spec = replace(spec, mount=replace(spec.mount, parent_from_optical=turned))
        elif fault.kind is FaultKind.WRONG_BOARD:
            printed = {board.body: board for board in spec.boards}
            boards = (_reprinted(b, printed[fault.other or ""]) if b.body == fault.entity else b for b in spec.boards)
            spec = replace(spec, boards=tuple(boards))
    return spec


def _reprinted(board: BoardSpec, other: BoardSpec) -> BoardSpec:
    return replace(board, code=other.code, square_mm=other.square_mm, tag=other.tag)


class WrongPictures:
    """Draws the pictures of one camera under its faults. Everything is prepared at the start."""

    def __init__(self, spec: RenderSpec) -> None:
        self._faults = spec.scenario.faults
        ends = {end for fault in self._faults for end in (fault.start_s, fault.end_s) if end is not None}
        scenes = {self._scene(at_s) for at_s in (0.0, *ends)}
        self._renderers = {scene: Renderer(spec_under(spec, scene)) for scene in scenes}
        self._last: Image | None = None

    def _scene(self, now_s: float) -> tuple[Fault, ...]:
        return tuple(fault for fault in self._faults if fault.kind in _SCENE and fault.covers(now_s))

    def render(self, states: Array, now_s: float) -> Image:
        """Return the picture (h, w) of the true states at a time since the first true state [s]."""
        kinds = {fault.kind for fault in self._faults if fault.covers(now_s)}
        renderer = self._renderers[self._scene(now_s)]
        if FaultKind.PICTURE_BLACK in kinds:
            return renderer.black()
        if FaultKind.PICTURE_FROZEN not in kinds or self._last is None:
            self._last = renderer.render(states)
        return self._last
