"""The pose sent to an autopilot: its pad, the tracker's estimate through the lift-off, or none."""

import pytest

from drivers.mavlink.parameters import needed
from drivers.mavlink.settings import MavlinkDriverSettings, VisionFeedback
from drivers.mavlink.vision import FIRST_SIGHT_NS, VisionFeed
from drivers.mavlink.wire.names import Flavour
from drivers.watchdog_types import WatchdogLimits
from groundstation.bus import clock
from groundstation.bus.messages import EntityEstimate, Estimate, Header

MS = 1_000_000
NOW = 1_000_000 * MS
PAD = (1.0, -0.5)


@pytest.fixture
def feed() -> VisionFeed:
    feed = VisionFeed("drone", clock.clock_id(), VisionFeedback(), PAD, 0.3)
    feed.pose(NOW, aloft=False)
    return feed


def believe(feed: VisionFeed, now_ns: int, x: float, y: float, z: float, contradicted: bool = False) -> None:
    covariance = tuple(4e-4 if place % 5 == 0 else 0.0 for place in range(16))
    entity = EntityEstimate("drone", "robot", (x, y, z, 0.3), covariance, (0.0, 0.0, 0.0), True, 0.1, 0.0, contradicted)
    header = Header(now_ns, clock.clock_id(), "team", "tracker", 1)
    feed.take(now_ns, Estimate(header=header, entities=(entity,), epoch=1))


def place(feed: VisionFeed, now_ns: int, aloft: bool) -> tuple[float, ...] | None:
    pose = feed.pose(now_ns, aloft)
    return None if pose is None else pose.position_m


def test_a_standing_vehicle_is_fed_its_pad(feed: VisionFeed) -> None:
    assert place(feed, NOW + 33 * MS, aloft=False) == (*PAD, 0.0)
    assert feed.lost_s(NOW) == 0.0


def test_the_estimate_is_fed_from_the_beginning_of_the_take_off_on(feed: VisionFeed) -> None:
    resets = feed.resets
    believe(feed, NOW, *PAD, 0.06)
    assert place(feed, NOW, aloft=False) == (*PAD, 0.0), "the first of a tracker says nothing of where it goes on from"
    for step, aloft in enumerate((False, False, True, True)):
        now_ns = NOW + 33 * MS * (step + 1)
        believe(feed, now_ns, PAD[0] + 0.02 * step, PAD[1], 0.06 + 0.03 * step)
        assert place(feed, now_ns, aloft) == (PAD[0] + 0.02 * step, PAD[1], 0.06 + 0.03 * step)
    assert feed.resets == resets + 1, "for the tracker's epoch alone"
    assert feed.lost_s(now_ns + 100 * MS) == pytest.approx(0.1)


def test_an_estimate_elsewhere_does_not_count_while_it_stands(feed: VisionFeed) -> None:
    believe(feed, NOW + 33 * MS, PAD[0] + 1.0, PAD[1], 0.06)  # the marker of another drone
    assert place(feed, NOW + 33 * MS, aloft=False) == (*PAD, 0.0)


def test_a_vehicle_carried_back_is_sent_its_pad_once_observed_there(feed: VisionFeed) -> None:
    for step in range(3):
        believe(feed, NOW + 33 * MS * step, PAD[0] + 2.0, PAD[1], 0.3)
        feed.pose(NOW + 33 * MS * step, aloft=step < 2)
    later = NOW + 60_000 * MS
    assert place(feed, later, aloft=False) == (PAD[0] + 2.0, PAD[1], 0.0), "where it landed"
    resets = feed.resets
    for step in range(3):
        believe(feed, later + 33 * MS * (step + 1), *PAD, 0.06)
        assert place(feed, later + 33 * MS * (step + 1), aloft=False) == (*PAD, 0.06 if step else 0.0)
    assert feed.resets == resets + 1


def test_a_pause_in_flight_is_a_reset_for_the_autopilot_has_coasted(feed: VisionFeed) -> None:
    now_ns, resets = NOW, []
    for pause_ms in (33, 33, 300, 33, 500, 33):
        now_ns += pause_ms * MS
        believe(feed, now_ns, *PAD, 0.5)
        assert place(feed, now_ns, aloft=True) is not None
        resets.append(feed.resets)
    assert [one - resets[0] for one in resets] == [0, 0, 0, 0, 1, 1]


def test_a_vehicle_aloft_is_fed_no_old_estimate(feed: VisionFeed) -> None:
    believe(feed, NOW + 33 * MS, *PAD, 0.06)
    assert place(feed, NOW + 66 * MS, aloft=True) is not None
    assert place(feed, NOW + 400 * MS, aloft=True) is None
    assert feed.lost_s(NOW + 1033 * MS) == pytest.approx(1.0)


def test_nothing_is_fed_while_sightings_contradict_the_estimate(feed: VisionFeed) -> None:
    believe(feed, NOW + 33 * MS, *PAD, 0.5)
    assert place(feed, NOW + 33 * MS, aloft=True) is not None
    believe(feed, NOW + 66 * MS, *PAD, 0.5, contradicted=True)
    assert place(feed, NOW + 66 * MS, aloft=True) is None
    assert feed.lost_s(NOW + 133 * MS) == pytest.approx(0.1)
    believe(feed, NOW + 133 * MS, *PAD, 0.5)
    assert place(feed, NOW + 133 * MS, aloft=True) is not None


def see(feed: VisionFeed, now_ns: int, x: float, age_s: float, std_m: float = 0.02) -> None:
    """Receive a vehicle without motion telemetry: its covariance has grown since it was observed."""
    covariance = tuple(0.15**2 if place % 5 == 0 else 0.0 for place in range(16))
    place = (x, PAD[1], 0.5, 0.3)
    entity = EntityEstimate("drone", "robot", place, covariance, (0.0,) * 3, True, age_s, 0.0, False, (age_s, std_m))
    header = Header(now_ns, clock.clock_id(), "team", "tracker", 1)
    feed.take(now_ns, Estimate(header=header, entities=(entity,), epoch=1))


def test_a_vehicle_that_tells_no_motion_is_fed_where_its_last_picture_showed_it(feed: VisionFeed) -> None:
    believe(feed, NOW + 33 * MS, *PAD, 0.5)
    feed.pose(NOW + 33 * MS, aloft=True)
    see(feed, NOW + 300 * MS, 1.2, age_s=0.2)
    pose = feed.pose(NOW + 300 * MS, aloft=True)
    assert pose is not None
    assert (pose.stamp_ns, pose.position_m[0]) == (NOW + 100 * MS, 1.2)
    assert pose.variances[:2] == pytest.approx((4e-4, 4e-4))
    assert feed.lost_s(NOW + 300 * MS) == pytest.approx(0.2)


@pytest.mark.parametrize(("age_s", "std_m"), [(0.45, 0.02), (0.2, 0.06)], ids=["long ago", "badly"])
def test_no_pose_is_sent_after_old_or_uncertain_observations(feed: VisionFeed, age_s: float, std_m: float) -> None:
    believe(feed, NOW + 33 * MS, *PAD, 0.5)
    see(feed, NOW + 600 * MS, 1.2, age_s, std_m)
    assert place(feed, NOW + 600 * MS, aloft=True) is None


def test_a_picture_is_one_place(feed: VisionFeed) -> None:
    believe(feed, NOW + 33 * MS, *PAD, 0.5)
    see(feed, NOW + 300 * MS, 1.2, age_s=0.2)
    see(feed, NOW + 350 * MS, 1.3, age_s=0.25)
    assert place(feed, NOW + 350 * MS, aloft=True) == (1.2, PAD[1], 0.5)


def test_a_place_that_a_picture_showed_is_told_once_and_only_where_nothing_better_is_known(feed: VisionFeed) -> None:
    see(feed, NOW + 300 * MS, 1.2, age_s=0.2)
    assert feed.sighted is not None and feed.sighted.position_m[0] == 1.2
    see(feed, NOW + 320 * MS, 1.2, age_s=0.22)
    assert feed.sighted is None
    see(feed, NOW + 400 * MS, 1.3, age_s=0.2)
    believe(feed, NOW + 420 * MS, *PAD, 0.5)
    assert feed.sighted is None


@pytest.mark.parametrize(("flavour", "lost_s"), [(Flavour.PX4, 0.8), (Flavour.ARDUPILOT, 0.0)])
def test_a_px4_misses_its_first_position_soon_after_its_lift_off(flavour: Flavour, lost_s: float) -> None:
    """EKF2_NOAID_TOUT lands it a second after the last: our landing, which says why, comes before that."""
    feed = VisionFeed("drone", clock.clock_id(), VisionFeedback(), PAD, 0.3, FIRST_SIGHT_NS[flavour])
    feed.pose(NOW, aloft=False)
    assert feed.missed == "from the cameras"
    assert place(feed, NOW, aloft=True) is None, "nobody knows that it is still over its pad"
    assert feed.lost_s(NOW + 1000 * MS) == pytest.approx(lost_s)
    assert feed.missed == "from the cameras since it lifted off"
    believe(feed, NOW + 1000 * MS, *PAD, 0.5)
    feed.pose(NOW + 1000 * MS, aloft=True)
    assert feed.lost_s(NOW + 1100 * MS) == pytest.approx(0.1) and feed.missed == "from the cameras"


def test_a_px4_that_nobody_finds_is_landed_before_it_lands_by_itself() -> None:
    landed_s = FIRST_SIGHT_NS[Flavour.PX4] / 1e9 + VisionFeedback().land_after_s
    (limit_us,) = [one.value for one in needed(Flavour.PX4, 255, {}) if "EKF2_NOAID_TOUT" in one.names]
    assert landed_s < limit_us / 1e6 + 0.1, "it notices a tenth of a second later"


def test_the_table_of_failsafes_has_the_times_of_a_vehicle_that_flies_on_our_position() -> None:
    row = {"name": "v", "system_id": 1, "flavour": "px4"}
    settings = MavlinkDriverSettings.model_validate({"link": {"target": "udpout:127.0.0.1:14550"}, "vehicles": [row]})
    flown, told = settings.authority(settings.vehicles[0]), WatchdogLimits()
    assert (flown.lost_hover_s, flown.lost_land_s) == (told.lost_hover_s, told.lost_land_s) == (0.3, 0.7)
