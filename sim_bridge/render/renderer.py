"""One camera's picture: floor, boxes, bodies and boards from far to near, defocus, smear, sensor noise."""

from collections.abc import Callable, Sequence
from functools import partial

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array, Image
from groundstation.geometry.pose import Pose
from sim_bridge.render.board_painter import BoardPainter, Flaws, smear_kernel
from sim_bridge.render.box_painter import BoxPainter, Cover
from sim_bridge.render.card import card_of
from sim_bridge.render.floor import Floor, texture
from sim_bridge.render.lens_table import LensTable
from sim_bridge.render.scene import CameraScene, Sight, compose_scene
from sim_bridge.render.sensor import ImageSensor
from sim_bridge.render.shapes import draw_body
from sim_bridge.render.spec import RenderSpec


class Renderer:
    """Draws frame after frame for one RenderSpec; deterministic for its seed and states."""

    def __init__(self, spec: RenderSpec) -> None:
        self._spec = spec
        self._random = np.random.default_rng([spec.seed, *spec.camera.encode()])
        intrinsics, room = spec.intrinsics, (spec.room_size_m[0], spec.room_size_m[1])
        table = LensTable(intrinsics)
        # The carpet is the room's: every camera of one run sees the same floor.
        self._floor = Floor(texture(spec.scenario.floor, room, spec.seed), room, table)
        self._painters = {board: BoardPainter(card_of(board), intrinsics, table) for board in spec.boards}
        focal_px = min(intrinsics.fx_px, intrinsics.fy_px)
        self._boxes = {box: BoxPainter(box.size_m, focal_px, spec.scenario.blur_px, table) for box in spec.boxes}
        self._sensor = ImageSensor(intrinsics.width_px, intrinsics.height_px, spec.scenario, self._random)
        fixed = not spec.mount.body
        self._background = self._blurred(self._floor.draw(spec.mount.parent_from_optical)) if fixed else None

    @property
    def spec(self) -> RenderSpec:
        """Return the spec that is drawn."""
        return self._spec

    def render(self, states: NDArray[np.float64]) -> Image:
        """Return the picture (h, w) of the true states (n, 13) of the spec's bodies."""
        scene = compose_scene(self._spec, states)
        picture = self._draw_floor(scene)
        covers = self._draw_boxes(picture, scene, states)
        for sight in scene.sights:
            place = scene.world_from_optical.apply(sight.optical_from_marker.translation)
            hiding = [cover for cover, hides in covers if hides(place)]
            before = picture.copy() if hiding else picture
            draw_body(picture, sight.board.shape, sight.optical_from_base, self._spec.intrinsics)
            painter = self._painters[sight.board]
            painter.draw(picture, sight.optical_from_marker, self._flaws(sight), self._random, sight.rolling)
            for cover in hiding:
                cover.keep(picture, before)
        return self._sensor.expose(picture, self._random)

    def black(self) -> Image:
        """Return the picture (h, w) of a covered lens: the sensor's noise alone."""
        intrinsics = self._spec.intrinsics
        return self._sensor.expose(np.zeros((intrinsics.height_px, intrinsics.width_px), np.uint8), self._random)

    def _draw_boxes(
        self, picture: Image, scene: CameraScene, states: NDArray[np.float64]
    ) -> list[tuple[Cover, Callable[[Array], bool]]]:
        """Draw the boxes over the floor, farthest first; returns what each covers, and which points it may hide."""
        camera = scene.world_from_optical
        drawn: list[tuple[Cover, Callable[[Array], bool]]] = []
        places = [(states[self._spec.bodies.index(box.body)][:3], painter) for box, painter in self._boxes.items()]
        for place, painter in sorted(places, key=lambda one: -float(np.linalg.norm(one[0] - camera.translation))):
            if (cover := painter.cover(place, camera)) is not None:
                cover.over(picture)
                drawn.append((cover, partial(painter.may_hide, place_m=place, world_from_optical=camera)))
        return drawn

    def _draw_floor(self, scene: CameraScene) -> Image:
        if self._background is not None:
            return self._background.copy()
        floor = self._blurred(self._floor.draw(scene.world_from_optical, scene.rolling))
        kernel = smear_kernel(self._floor_smear(*scene.smear))
        return floor if kernel is None else np.asarray(cv2.filter2D(floor, -1, kernel), dtype=np.uint8)

    def _floor_smear(self, begin: Pose, end: Pose) -> tuple[float, float]:
        """Return the motion of the floor in the middle of the picture during the exposure [px]."""
        axis = begin.rotation[:, 2]
        distance = begin.translation[2] / max(-axis[2], 0.1)
        seen = (begin.translation + distance * axis - end.translation) @ end.rotation
        return self._way((0.0, 0.0, 1.0), seen.tolist())

    def _blurred(self, picture: Image) -> Image:
        sigma = self._spec.scenario.blur_px
        return np.asarray(cv2.GaussianBlur(picture, (3, 3), sigma), dtype=np.uint8) if sigma > 0.0 else picture

    def _flaws(self, sight: Sight) -> Flaws:
        scenario = self._spec.scenario
        smear = self._way(sight.begin_m.tolist(), sight.end_m.tolist())
        return Flaws(scenario.corner_noise_px, scenario.blur_px, smear)

    def _way(self, begin_m: Sequence[float], end_m: Sequence[float]) -> tuple[float, float]:
        """Return the vector in the picture from one point [optical] to another [px]; 0 if one is beyond the lens."""
        begin, end = (self._spec.intrinsics.pixel(*point) for point in (begin_m, end_m))
        return (0.0, 0.0) if begin is None or end is None else (end[0] - begin[0], end[1] - begin[1])
