"""The few settings that a report needs, from the resolved field attached to the recording."""

import msgspec

Interval = tuple[float, float]


class Fence(msgspec.Struct, frozen=True):
    """Box that drones must stay in [m; world]."""

    x_m: Interval = (-1e9, 1e9)
    y_m: Interval = (-1e9, 1e9)
    z_m: Interval = (-1e9, 1e9)


class Room(msgspec.Struct, frozen=True):
    """Size along x, y, z, origin in the middle of the floor, and the fence."""

    size_m: tuple[float, float, float] = (8.0, 6.0, 4.0)
    fence: Fence = Fence()


class Calibration(msgspec.Struct, frozen=True):
    """Picture size and focal lengths [px]."""

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float


class WorldCamera(msgspec.Struct, frozen=True):
    """A camera that looks straight down."""

    position_m: tuple[float, float, float]
    calibration: Calibration

    def footprint_half_m(self, height_m: float) -> tuple[float, float]:
        """Return half the width and depth of what it sees at a height [m along world x, y]."""
        below = max(0.0, self.position_m[2] - height_m)
        lens = self.calibration
        return below * lens.width_px / (2 * lens.fx_px), below * lens.height_px / (2 * lens.fy_px)


class Target(msgspec.Struct, frozen=True):
    """Who is tracked, where it is one alone."""

    name: str = "turtlebot"


class Estimator(msgspec.Struct, frozen=True):
    """Rate of the tracker."""

    rate_hz: float = 50.0


class Planner(msgspec.Struct, frozen=True):
    """Height slots by number of levels [m]."""

    level_heights_m: tuple[tuple[float, ...], ...] = ()


class Safety(msgspec.Struct, frozen=True):
    """Smallest permitted distance between drone centres."""

    min_separation_m: float = 0.0


class Arena(msgspec.Struct, frozen=True):
    """The resolved field, as far as a report cares."""

    site: str = ""
    room: Room = Room()
    cameras: dict[str, WorldCamera] = {}
    drones: dict[str, msgspec.Raw] = {}
    target: Target | None = Target()
    targets: dict[str, msgspec.Raw] = {}
    estimator: Estimator = Estimator()
    planner: Planner = Planner()
    safety: Safety = Safety()

    @property
    def tracked(self) -> tuple[str, ...]:
        """Return the names of the targets."""
        return tuple(self.targets) or ((self.target.name,) if self.target else ())

    @property
    def heights_m(self) -> tuple[float, ...]:
        """Return the distinct height slots that this team can use, lowest first."""
        rows = self.planner.level_heights_m[: len(self.drones)]
        return tuple(sorted({height for row in rows for height in row}))


def arena_from_json(data: bytes) -> Arena:
    """Return the arena of a `field.json`; raises msgspec.DecodeError when it is none."""
    return msgspec.json.decode(data, type=Arena)
