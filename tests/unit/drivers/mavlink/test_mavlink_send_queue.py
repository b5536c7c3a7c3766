"""What goes next into a line that carries less than all: orders before poses and setpoints, of these the newest."""

import pytest

from drivers.mavlink.send_queue import SendQueue
from drivers.mavlink.wire.flight import OdometryMessage, SetPositionTargetLocalNed, command_to
from drivers.mavlink.wire.frames import FrameEncoder
from drivers.mavlink.wire.names import MavCmd
from drivers.mavlink.wire.telemetry import OUR_HEARTBEAT

MS = 1_000_000
LAND, ARM = command_to(2, MavCmd.NAV_LAND), command_to(2, MavCmd.COMPONENT_ARM_DISARM, 1.0)


def setpoint(number):
    return SetPositionTargetLocalNed(number, 2, 1, 8, 0x5C7, *(0.0,) * 11)


def pose(number):
    return OdometryMessage(number, 1, 12, 0.0, 0.0, 0.0, (1.0,) * 4, *(0.0,) * 6, (0.1,) * 21, (0.1,) * 21, 0, 2, 0)


class Line:
    """A queue, and the frames that it left out."""

    def __init__(self, bytes_per_s=5760.0):
        self.dropped = 0
        self.queue = SendQueue(bytes_per_s, self._drop)

    def _drop(self):
        self.dropped += 1

    def put(self, now_ns, *contents, system=2):
        for content in contents:
            self.queue.put(now_ns, system, content)

    def all_taken(self, now_ns):
        return [waiting.content for waiting in iter(lambda: self.queue.take(now_ns), None)]


@pytest.fixture
def line():
    return Line()


def test_orders_go_first_in_their_order_then_the_rest_then_the_newest_pose_and_setpoint(line):
    line.put(0, setpoint(1), pose(1), OUR_HEARTBEAT, ARM, setpoint(2), LAND)
    assert line.all_taken(0) == [ARM, LAND, OUR_HEARTBEAT, setpoint(2), pose(1)]
    assert line.dropped == 1 and line.queue.wait_ns(0) is None


def test_frames_of_others_are_ranked_too(line):
    encoder = FrameEncoder(255, 190)
    first, second, land = (encoder.encode(one) for one in (setpoint(1), setpoint(2), LAND))
    line.put(0, first, second, land)
    assert line.all_taken(0) == [land, second] and line.dropped == 1


def test_each_vehicle_has_its_own_newest(line):
    line.put(0, setpoint(1), system=2)
    line.put(0, setpoint(2), system=3)
    assert line.all_taken(0) == [setpoint(1), setpoint(2)] and line.dropped == 0


def test_the_kernel_gets_no_more_than_a_tenth_of_a_second(line):
    line.put(0, *(ARM,) * 30)
    handed = 0
    while line.queue.take(0) is not None:
        line.queue.note_sent(0, 45)
        handed += 45
    assert 0.05 <= handed / 5760 <= 0.1
    due_ns = line.queue.wait_ns(0)
    assert due_ns > 0 and line.queue.take(due_ns - 1) is None and line.queue.take(due_ns) is not None


def test_what_waited_too_long_is_not_sent(line):
    line.put(0, setpoint(1), ARM)
    assert line.queue.wait_ns(0) == 0
    assert line.all_taken(400 * MS) == [ARM]
    line.put(500 * MS, ARM)
    assert line.all_taken(1600 * MS) == [] and line.dropped == 2


def test_a_saturated_line_lands_at_once_and_shares_what_is_left():
    """Poses of a PX4 at 30 Hz and setpoints at 20 Hz need 8.7 kB/s of 5.76."""
    line, sizes = Line(), {OdometryMessage: 245, SetPositionTargetLocalNed: 65, type(LAND): 45}
    ordered_ns, delays, sent = 0, [], dict.fromkeys(sizes, 0)
    for now_ns in range(0, 10_000 * MS, MS):
        tick = now_ns // MS
        if tick % 33 == 0:
            line.put(now_ns, pose(tick))
        if tick % 50 == 0:
            line.put(now_ns, setpoint(tick))
        if tick % 500 == 7:
            ordered_ns = now_ns
            line.put(now_ns, LAND)
        if (waiting := line.queue.take(now_ns)) is not None:
            line.queue.note_sent(now_ns, sizes[type(waiting.content)])
            sent[type(waiting.content)] += 1
            if waiting.content == LAND:
                delays.append((now_ns - ordered_ns) / MS)
            else:
                assert now_ns - waiting.since_ns <= 100 * MS
    assert len(delays) == 20 and max(delays) <= 50
    assert sent[OdometryMessage] > 160 and sent[SetPositionTargetLocalNed] > 190
