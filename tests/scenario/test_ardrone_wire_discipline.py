"""Every datagram of a driver beside a busy machine: form and numbers are judged, gaps only reported.

As a script it is the driver's process: `test_ardrone_wire_discipline.py ADDRESS`.
"""

import itertools
import multiprocessing
import re
import socket
import struct
import subprocess
import sys
import time
from contextlib import suppress

import pytest

SECONDS = 20.0
LINE = re.compile(r'AT\*[A-Z_]+=(\d+)(,(-?\d+|"[^"]{1,127}"))*')
SO_TIMESTAMPNS = 35
COMMAND, BOOTSTRAP = 1 << 6, 1 << 11


def drive(address: str) -> None:
    """Run the whole driver with a bus in memory and a real clock, until killed."""
    from drivers.ardrone.driver import run
    from groundstation.bus.api import Bus
    from groundstation.bus.memory_bus import MemoryBus, MemoryExchange

    class Process:
        name, section = "drone_1", f'{{"name": "drone_1", "address": "{address}"}}'
        stop_requested, supervisor_alive, supervisor_fresh, spoken_for_ns = False, True, True, 0
        bus: Bus = MemoryBus(MemoryExchange(), "lab", "drone_1")

        def beat(self): ...
        def ready(self, detail=""): ...
        def degrade(self, detail, works=True): ...
        def note_addresses(self, addresses): ...
        def finish(self): ...
        def leave(self, number): ...
        def tick_status(self, ticks=0, overruns=0, overflowed=0): ...
        def event(self, severity, text, remedy="", entity=None): ...
        def wake(self): ...

        def sleep_until(self, deadline_ns):
            time.sleep(max(0, deadline_ns - time.monotonic_ns()) / 1e9)
            return True

    run(Process())


def burn(ends_s: float) -> None:
    while time.monotonic() < ends_s:
        sum(i * i for i in range(10_000))


class Recorder:
    """The drone's side: sends the acknowledgements, streams 200 packets a second, records arrival times."""

    def __init__(self, address: str, navdata: bytes) -> None:
        self.navdata, self.at = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        self.at.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self.at.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        self.navdata.bind((address, 5554))
        self.at.bind((address, 5556))
        for udp in (self.navdata, self.at):
            udp.setblocking(False)
        self.body = bytearray(navdata[:-8])
        self.state, self.number = BOOTSTRAP | 0x0F800000, 0
        self.client: tuple[str, int] | None = None
        self.came: list[tuple[int, bytes]] = []

    def close(self) -> None:
        self.navdata.close()
        self.at.close()

    def turn(self) -> None:
        with suppress(BlockingIOError):
            self.client = self.navdata.recvfrom(64)[1]
        while True:
            try:
                datagram, extra, _, _ = self.at.recvmsg(2048, 64)
            except BlockingIOError:
                break
            # By the kernel's clock: a late read by this process does not matter.
            seconds, nanoseconds = struct.unpack("qq", extra[0][2])
            self.came.append((seconds * 10**9 + nanoseconds, datagram))
            if b"AT*CONFIG=" in datagram:
                self.state = (self.state | COMMAND) & ~BOOTSTRAP
            if b",5,0\r" in datagram:
                self.state &= ~COMMAND
        if self.client is not None:
            self.number += 1
            struct.pack_into("<II", self.body, 4, self.state, self.number)
            self.navdata.sendto(bytes(self.body) + struct.pack("<HHI", 0xFFFF, 8, sum(self.body)), self.client)


def gaps_ms(stamps: list[int]) -> list[float]:
    return sorted((b - a) / 1e6 for a, b in itertools.pairwise(stamps))


@pytest.mark.slow
@pytest.mark.timeout(120)
@pytest.mark.parametrize("load", [pytest.param(0, id="idle", marks=pytest.mark.exhaustive), pytest.param(4, id="busy")])
def test_form_and_numbers_of_every_datagram(load, golden_packet, record_property, capsys):
    address = f"127.31.{load}.9"
    drone = Recorder(address, golden_packet("full-landed"))
    ends_s = time.monotonic() + SECONDS
    burners = [multiprocessing.get_context("spawn").Process(target=burn, args=(ends_s,)) for _ in range(load)]
    driver = subprocess.Popen([sys.executable, __file__, address])
    try:
        for burner in burners:
            burner.start()
        while time.monotonic() < ends_s:
            drone.turn()
            time.sleep(0.005)
    finally:
        driver.kill()
        driver.wait()
        for burner in burners:
            burner.join(10)
        drone.close()
    numbers = []
    for _, datagram in drone.came:
        assert len(datagram) <= 1000 and datagram.endswith(b"\r")
        for line in datagram[:-1].decode("ascii").split("\r"):
            match = LINE.fullmatch(line)
            assert match, line
            numbers.append(int(match[1]))
    rising = [number for number in numbers if number != 1]
    assert rising == list(range(2, len(rising) + 2)), "strictly one more, but for the 1 that resets the drone's count"
    assert numbers[-1000:].count(1) == 0, "once it obeys"
    assert len(drone.came) > 20 * SECONDS / 2
    gaps = gaps_ms([stamp for stamp, _ in drone.came])
    text = ", ".join(f"p{share:g} {gaps[int(len(gaps) * share / 100)]:.1f} ms" for share in (50, 99, 99.9))
    late = sum(gap >= 50 for gap in gaps)
    record_property("gaps", text)
    with capsys.disabled():
        print(f"\n{load} busy processes: {len(gaps)} gaps: {text}, most {gaps[-1]:.1f} ms; {late} of 50 ms or more")


if __name__ == "__main__":
    drive(sys.argv[1])
