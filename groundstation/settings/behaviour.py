"""Settings of the estimator, the planner, safety, the recording and the console."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field
from pydantic_core import PydanticCustomError

from groundstation import plug_ins
from groundstation.settings.values import AddressOrNone, SettingsSection

Height = Annotated[float, Field(ge=0.3, le=20)]


class EstimatorSettings(SettingsSection):
    """The joint EKF: its rate, its gate, and when a measurement is too late or a target lost."""

    rate_hz: Annotated[int, Field(ge=10, le=200)] = 50
    """Ticks of the tracker per second: the belief is advanced and setpoints are sent at this rate."""
    max_lateness_s: Annotated[float, Field(gt=0, le=5)] = 0.5
    """Age [s] up to which a late measurement is still fused in its place; an older one is refused as LATE."""
    gate_probability: Annotated[float, Field(ge=0.5, lt=1)] = 0.997
    """Share of good measurements that the chi-square gate lets pass (0.997: 3 sigma of one axis). Larger accepts
    more outliers; smaller gives more good measurements less weight."""
    lost_after_s: Annotated[float, Field(gt=0, le=60)] = 3.0
    """Time [s] without an observation of a target after which the team searches for it."""


def _falling(levels: tuple[float, ...]) -> tuple[float, ...]:
    if any(upper <= lower for upper, lower in pairwise(levels)):
        raise PydanticCustomError("falling", "heights must fall from the top level to the lowest")
    return levels


def _one_row_more(rows: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
    for number, row in enumerate(rows, start=1):
        if len(row) != number:
            raise PydanticCustomError(
                "rows", "row {n} must hold {n} heights, one for each level (got {m})", {"n": number, "m": len(row)}
            )
    return rows


LevelHeights = Annotated[
    tuple[Annotated[tuple[Height, ...], AfterValidator(_falling)], ...],
    AfterValidator(_one_row_more),
]


def _known_planner(name: str) -> str:
    known = plug_ins.names(plug_ins.PLANNERS)
    if name and name not in known:
        told = {"known": ", ".join(known) or "none is installed", "damage": plug_ins.damage()}
        raise PydanticCustomError("planner", "must be an installed planner: {known}{damage}", told)
    if name:
        try:
            plug_ins.load(plug_ins.PLANNERS, name)
        except plug_ins.PlugInError as error:
            raise PydanticCustomError("planner", "{reason}", {"reason": str(error)}) from None
    return name


def _as_named_now(mode: object) -> object:
    """Accept the name of older field files, which promised a proof that does not exist in four degrees of freedom."""
    return "multistart" if mode == "certified" else mode


class PlannerSettings(SettingsSection):
    """The search over sensing topologies and velocities."""

    rate_hz: Annotated[int, Field(ge=1, le=50)] = 10
    """Plans per second; at most the estimator's rate."""
    mode: Annotated[Literal["multistart", "paper"], BeforeValidator(_as_named_now)] = "multistart"
    """multistart: several starting points per topology, hysteresis and a minimum stay. paper: as in the method's paper,
    each topology solved once, from rest, and the cheapest wins."""
    plug_in: Annotated[str, AfterValidator(_known_planner)] = ""
    """Name of a planner of another package (entry point `skein.planners`) that plans instead; empty: ours."""
    horizon_steps: Annotated[int, Field(ge=1, le=50)] = 10
    """Number of steps that a plan looks ahead. A change of topology must pay within horizon_steps x step_s."""
    step_s: Annotated[float, Field(gt=0, le=2)] = 0.2
    """Length [s] of one step of the horizon."""
    discount: Annotated[float, Field(gt=0, le=1)] = 0.9
    """Weight of each further step of the horizon relative to the one before it; 1: all count alike."""
    hysteresis: Annotated[float, Field(ge=0, lt=1)] = 0.05
    """Share of the cost by which a new topology must be cheaper than the current one before the team changes."""
    initial_topology: Literal["flat", "string"] = "flat"
    """Topology after take-off. flat: all drones in one level; string: one drone per level."""
    level_heights_m: LevelHeights = ()
    """Heights [m above the floor] with which the search begins; left out, they follow from target, fence and
    planned_range_m. Row n holds n heights, top level first, for a topology with n levels; one row per drone at least.
    All must lie above the target and inside the fence; the planner chooses between the lowest and the highest."""
    planned_range_m: Annotated[float, Field(gt=0, le=20)] = 1.9
    """Distance [m] up to which the planner expects a drone's camera to detect a marker."""
    separation_m: Annotated[float, Field(gt=0, le=10)] = 1.0
    """Horizontal distance [m] below which the cost drives drones apart; at least safety.min_separation_m."""

    @property
    def heights_m(self) -> tuple[float, float]:
        """Return the lowest and the highest permitted height [m]."""
        heights = [height for row in self.level_heights_m for height in row]
        return min(heights), max(heights)


class SafetySettings(SettingsSection):
    """Safety limits and communication time-outs."""

    min_separation_m: Annotated[float, Field(ge=0.3, le=10)] = 0.6
    """Least distance [m] between the centres of two drones; velocities that would go below it are limited before."""
    setpoint_lifetime_ms: Annotated[int, Field(ge=100, le=500)] = 300
    """Time [ms] after which a setpoint expires; a drone without a fresh one hovers, and after 500 needs RESUME."""
    land_after_s: Annotated[float, Field(ge=0.5, le=30)] = 3.0
    """Time [s] of silence (setpoints, telemetry, supervisor, driver) after which a drone lands, and stays down until a
    new take-off; PX4 and ArduPilot whose driver is dead: 0.5 s."""
    unseen_land_after_s: Annotated[float, Field(ge=1, le=60)] = 10.0
    """Time [s] after which a drone lands that is known worse than max_position_std_m, or that a camera should see and
    does not; one that no camera sees lands after three times as long, however well it is known."""
    max_position_std_m: Annotated[float, Field(gt=0, le=5)] = 0.6
    """Largest standard deviation [m] of a drone's own position; a drone whose position is known less well hovers."""


class RecordingSettings(SettingsSection):
    """What is recorded of a run, and where."""

    enabled: bool = True
    """Whether the run is recorded. Reports and replays need the recording."""
    directory: Annotated[str, Field(min_length=1)] = "runs"
    """Folder for the runs, relative to the working directory; each run makes a folder in it."""
    image_fps: Annotated[float, Field(ge=0, le=5)] = 5.0
    """Pictures per second and camera that are shown in the console and recorded; 0: none. The H.264 video of a camera
    is recorded in full besides, unless this is 0."""
    pictures: Literal["none", "blurred", "full"] = "full"
    """Which pictures are recorded. blurred: an eighth of the detail, so that nobody can be recognised, and no video.
    The console shows them as they are."""
    raw_datagrams: bool = True
    """Whether every datagram of the vehicle links is recorded, byte by byte."""
    rotate_mb: Annotated[float, Field(ge=0, le=100_000)] = 1000.0
    """Size [MB] at which a recording starts a new part (state-2.mcap, ...), at most once a second; 0: never."""
    rotate_minutes: Annotated[float, Field(ge=0, le=1440)] = 60.0
    """Time [min] after which a recording starts a new part; 0: never."""
    keep_gb: Annotated[float, Field(ge=0, le=1_000_000)] = 0.0
    """Size [GB] of all runs in the folder; beyond it the oldest are removed before the next starts, except those with a
    file named KEEP in their folder. 0: keep all."""


class Console(SettingsSection):
    """The operator's web page, on loopback, and for invited devices in the network."""

    enabled: bool = True
    """Whether the run serves the operator's web page."""
    port: Annotated[int, Field(ge=1024, le=65535)] = 8765
    """TCP port of the page. If it is taken, the next free one is used and printed."""
    listen: AddressOrNone = ""
    """Address of this host at which tablets and phones find the page, over TLS and by an invitation that works once
    (`groundstation console --invite`); empty: loopback only."""


class Bus(SettingsSection):
    """The router that all processes of a run talk through.

    4717 is nobody's: IANA has not assigned it; it lies apart from Zenoh (7446, 7447, 8000), DDS (7400 and up), MAVLink
    and autopilots in simulation (14550, 4560, 5760), web servers, and the ports that Linux gives to clients (32768 up).
    """

    port: Annotated[int, Field(ge=1024, le=65535)] = 4717
    """TCP port of the router. A simulated run takes the next free one if it is taken."""
    listen: AddressOrNone = ""
    """Address of this host at which hosts that the site has admitted (`groundstation site`) may stop and order, and run
    the devices that name them (`host`); empty: loopback only."""
    name_refusals: bool = True
    """Whether an event names each member of the run that publishes what it may not. The router traces every message for
    that; without it, it drops such messages silently."""
