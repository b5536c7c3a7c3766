"""One camera's picture: floor, bodies and boards from far to near, defocus, smear, sensor noise."""

import cv2
import numpy as np
from numpy.typing import NDArray

from sim_bridge.render.board_painter import BoardPainter, Flaws
from sim_bridge.render.floor import Floor, carpet
from sim_bridge.render.lens_table import LensTable
from sim_bridge.render.scene import Scene, Sight, compose_scene
from sim_bridge.render.sensor import SensorNoise
from sim_bridge.render.shapes import draw_body
from sim_bridge.render.spec import RenderSpec

Picture = NDArray[np.uint8]


class Renderer:
    """Draws frame after frame for one RenderSpec; deterministic for its seed and states."""

    def __init__(self, spec: RenderSpec) -> None:
        self._spec = spec
        self._random = np.random.default_rng([spec.seed, *spec.camera.encode()])
        intrinsics, room = spec.intrinsics, (spec.room_size_m[0], spec.room_size_m[1])
        table = LensTable(intrinsics)
        # The carpet is the room's: every camera of one run sees the same floor.
        self._floor = Floor(carpet(room, spec.seed), room, table)
        self._painters = {board: BoardPainter(board.code, board.square_mm, intrinsics, table) for board in spec.boards}
        self._noise = SensorNoise(intrinsics.width_px, intrinsics.height_px, spec.scenario.pixel_noise, self._random)
        fixed = not spec.mount.body
        self._background = self._blurred(self._floor.draw(spec.mount.parent_from_optical)) if fixed else None

    def render(self, states: NDArray[np.float64]) -> Picture:
        """Return the picture (h, w) of the true states (n, 13) of the spec's bodies."""
        scene = compose_scene(self._spec, states)
        picture = self._draw_floor(scene)
        for sight in scene.sights:
            draw_body(picture, sight.board.shape, sight.optical_from_base, self._spec.intrinsics)
            painter = self._painters[sight.board]
            painter.draw(picture, sight.optical_from_marker, self._flaws(sight), self._random)
        return self._noise.add(picture, self._random)

    def _draw_floor(self, scene: Scene) -> Picture:
        if self._background is not None:
            return self._background.copy()
        return self._blurred(self._floor.draw(scene.world_from_optical))

    def _blurred(self, picture: Picture) -> Picture:
        sigma = self._spec.scenario.blur_px
        return np.asarray(cv2.GaussianBlur(picture, (3, 3), sigma), dtype=np.uint8) if sigma > 0.0 else picture

    def _flaws(self, sight: Sight) -> Flaws:
        scenario = self._spec.scenario
        begin, end = self._spec.intrinsics.project(np.stack((sight.begin_m, sight.end_m)))
        smear = end - begin
        if not np.isfinite(smear).all():
            smear = np.zeros(2)
        return Flaws(scenario.corner_noise_px, scenario.blur_px, (float(smear[0]), float(smear[1])))
