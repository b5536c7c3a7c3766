"""The star over real Zenoh on loopback: delivery, forwarding past a stalled reader, absent and taken endpoints."""

import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import closing

import pytest
from free_port import free_port

from groundstation.bus import keys, topics, zenoh_bus
from groundstation.bus.api import Subscription
from groundstation.bus.messages import Estimate, Event, Severity
from groundstation.errors import GroundStationError


def free_endpoint() -> str:
    return f"tcp/127.0.0.1:{free_port()}"


@pytest.fixture
def endpoint() -> Iterator[str]:
    address = free_endpoint()
    router = zenoh_bus.open_router(address)
    yield address
    router.close()


@pytest.fixture
def router() -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A router in a process of its own, which can be stopped, and before it its endpoint."""
    address = free_endpoint()
    code = "import sys; from groundstation.bus.zenoh_bus import open_router as o; r = o(sys.argv[1]); print(); input()"
    command = [sys.executable, "-c", code, address]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline()
        yield address, process
        process.kill()


def send_until_heard(sender: zenoh_bus.ZenohBus, subscription: Subscription) -> int:
    """Publish until all subscribers are known; returns how many messages arrived."""
    for _ in range(100):
        sender.publish(topics.EVENT, Event(header=sender.header("drone_1"), severity=Severity.INFO, text="x"))
        if subscription.wait(0.05):
            return len(subscription.drain())
    return 0


def test_clients_hear_each_other_through_the_router(endpoint: str) -> None:
    with closing(zenoh_bus.open_bus(endpoint, "lab", "a")) as a, closing(zenoh_bus.open_bus(endpoint, "lab", "b")) as b:
        assert send_until_heard(a, b.subscribe([topics.EVENT])) >= 1


def test_another_site_hears_nothing(endpoint: str) -> None:
    with (
        closing(zenoh_bus.open_bus(endpoint, "lab", "a")) as a,
        closing(zenoh_bus.open_bus(endpoint, "barn", "b")) as b,
    ):
        here, there = a.subscribe([topics.EVENT]), b.subscribe([topics.EVENT])
        assert send_until_heard(a, here) >= 1
        assert there.drain() == []


def test_all_of_a_burst_of_sensor_samples_arrives(endpoint: str) -> None:
    """As after a stall of the router; messages missing in a recording cannot be replayed (decision 0132)."""
    count = 3000
    with (
        closing(zenoh_bus.open_bus(endpoint, "lab", "drone_1")) as sender,
        closing(zenoh_bus.open_bus(endpoint, "lab", "recorder")) as recorder,
    ):
        heard = recorder.subscribe([topics.EVENT, topics.IMU], capacity=2 * count)
        assert send_until_heard(sender, heard) >= 1
        for number in range(count):
            sender.put(topics.IMU, "drone_1", b"%300d" % number, b"")
        samples: list[int] = []
        deadline = time.monotonic() + 5
        while len(samples) < count and time.monotonic() < deadline:
            heard.wait(0.1)
            samples += [int(sample.payload) for sample in heard.drain_samples() if "/imu/" in sample.key]
        assert samples == list(range(count))


def test_a_setpoint_for_each_drone_waits_for_a_router_that_stands_still(
    router: tuple[str, subprocess.Popen[str]],
) -> None:
    """They are put back to back, each in a batch of its own (decision 0290)."""
    address, process = router
    drones = [f"drone_{number}" for number in range(1, 13)]
    with (
        closing(zenoh_bus.open_bus(address, "lab", "tracker")) as tracker,
        closing(zenoh_bus.open_bus(address, "lab", "recorder")) as recorder,
    ):
        heard = recorder.subscribe([topics.EVENT, topics.SETPOINT])
        assert send_until_heard(tracker, heard) >= 1
        process.send_signal(signal.SIGSTOP)
        for _ in range(300):  # fills the socket, so that batches wait
            tracker.put(topics.IMAGE, "ceiling", bytes(60000), b"")
        for drone in drones:
            tracker.put(topics.SETPOINT, drone, bytes(300), b"")
        process.send_signal(signal.SIGCONT)
        arrived: set[str] = set()
        deadline = time.monotonic() + 5
        while len(arrived) < len(drones) and time.monotonic() < deadline:
            heard.wait(0.1)
            arrived |= {sample.key.split("/")[3] for sample in heard.drain_samples() if "/setpoint/" in sample.key}
    assert arrived == set(drones)


def test_a_reader_that_never_drains_stalls_nobody(endpoint: str) -> None:
    with (
        closing(zenoh_bus.open_bus(endpoint, "lab", "a")) as a,
        closing(zenoh_bus.open_bus(endpoint, "lab", "b")) as b,
        closing(zenoh_bus.open_bus(endpoint, "lab", "c")) as c,
    ):
        stalled, reader = b.subscribe([topics.EVENT], capacity=10), c.subscribe([topics.EVENT])
        assert send_until_heard(a, reader) >= 1
        for number in range(1000):
            a.publish(topics.EVENT, Event(header=a.header("drone_1"), severity=Severity.INFO, text=str(number)))
        texts: list[str] = []
        deadline = time.monotonic() + 5
        while "999" not in texts and time.monotonic() < deadline:
            reader.wait(0.1)
            texts += [item.message.text for item in reader.drain() if isinstance(item.message, Event)]
        assert [text for text in texts if text != "x"] == [str(number) for number in range(1000)]
        assert len(stalled.drain_samples()) == 10


def test_a_rate_limit_thins_its_own_keys_only(endpoint: str) -> None:
    thinned = {keys.expression("lab", topics.ESTIMATE, name): 10.0 for name in ("team_a", "team_b")}
    with (
        closing(zenoh_bus.open_bus(endpoint, "lab", "a")) as a,
        closing(zenoh_bus.open_bus(endpoint, "lab", "b", at_most_hz=thinned)) as b,
    ):
        queue = b.subscribe([topics.ESTIMATE, topics.EVENT])
        send_until_heard(a, queue)
        for _ in range(50):
            for name in ("team_a", "team_b", "team_c"):
                a.publish(topics.ESTIMATE, Estimate(header=a.header(name), entities=(), epoch=1))
            time.sleep(0.02)
        queue.wait(0.5)
        heard = Counter(received.header.entity for received in queue.drain() if isinstance(received.message, Estimate))
    assert heard["team_c"] == 50 and 5 <= heard["team_a"] <= 25 and 5 <= heard["team_b"] <= 25, heard


def test_an_absent_router_is_named() -> None:
    endpoint = free_endpoint()
    with pytest.raises(GroundStationError, match=endpoint):
        zenoh_bus.open_bus(endpoint, "lab", "a", timeout_s=0.2)


def test_a_taken_port_is_named(endpoint: str) -> None:
    with pytest.raises(GroundStationError, match="is another run using this port"):
        zenoh_bus.open_router(endpoint)
