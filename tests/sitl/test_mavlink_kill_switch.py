"""The COM_RC_IN_MODE values with which a transmitter's kill switch stops a real PX4; others are refused.

`make test-firmware`. RC_CHANNELS_OVERRIDE stands for the transmitter: PX4 handles it as it handles a receiver's
channels. MANUAL_CONTROL is the joystick of a ground station.
"""

import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.links.opening import open_link
from drivers.mavlink.parameters import needed
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.setup import ParameterSetup
from drivers.mavlink.wire.names import Flavour

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))  # for the helper modules of this folder
from firmware import VARIABLES, Firmware, binary_of  # noqa: E402
from mavlink_pilot import Pilot  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.firmware, pytest.mark.timeout(120)]
SYSTEM, NAME = 5, "COM_RC_IN_MODE"
CHANNELS = {"RC_CHAN_CNT": 8.0, "RC_MAP_THROTTLE": 3.0, "RC_MAP_KILL_SW": 5.0}
KILL_OFF, KILL_ON = 1000, 2000
RATE_HZ = 25


class Hands:
    """A transmitter, and optionally a joystick, beside one PX4."""

    def __init__(self, port: int) -> None:
        self._mav = dialect.MAVLink(None, 254, 190)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", port))
        self._socket.settimeout(20.0)
        self._peer: tuple[str, int] = self._socket.recvfrom(2048)[1]

    def _send(self, message) -> None:
        self._socket.sendto(message.pack(self._mav), self._peer)

    def move(self, seconds: float, kill: int | None, joystick: bool) -> None:
        """Hold switch (None: the transmitter is off) and joystick in a position for a while."""
        for _ in range(round(seconds * RATE_HZ)):
            if joystick:
                self._send(dialect.MAVLink_manual_control_message(SYSTEM, 0, 0, 500, 0, 0))
            if kill is not None:
                channels = (1500, 1500, 1000, 1500, kill, 1000, 1000, 1000)
                self._send(dialect.MAVLink_rc_channels_override_message(SYSTEM, 1, *channels))
            time.sleep(1 / RATE_HZ)

    def close(self) -> None:
        self._socket.close()


def kills(firmware: Firmware, joystick: bool) -> bool:
    """Return whether the switch stops it, with a joystick that was connected first or without."""
    hands = Hands(firmware.port)
    try:
        time.sleep(3.0)
        hands.move(1.5, None, joystick)
        hands.move(2.0, KILL_OFF, joystick)
        hands.move(2.0, KILL_ON, joystick)
        # Its check before arming complains of the switch in any case.
        return "Kill engaged" in (firmware.folder / "log1.txt").read_text(errors="replace")
    finally:
        hands.close()


@contextmanager
def started(folder: Path, value: int) -> Iterator[Firmware]:
    """Start a PX4 set up for flight, and write the parameter as `setup` does for such a field file."""
    if not binary_of("px4"):
        pytest.skip(f"{VARIABLES['px4']} names no SITL binary: none is in a package registry")
    wanted = {one.name: one.value for one in needed(Flavour.PX4, 255)}
    firmware = Firmware("px4", folder, SYSTEM, wanted | CHANNELS)
    try:
        set_up(firmware.port, {NAME: float(value)})
        yield firmware
    finally:
        firmware.end()


def set_up(port: int, overrides: dict[str, float]) -> list[str]:
    """Write differing parameters, and read them back; returns the written names."""
    link = open_link(LinkSettings(target=f"udpin:127.0.0.1:{port}"))
    try:
        setup = ParameterSetup(link, SYSTEM, Flavour.PX4, 255, overrides)
        setup.connect()
        written = [d.wanted.name for d in setup.differences() if setup.apply(d.wanted)]
        assert not list(setup.differences())
        return written
    finally:
        link.close()


@pytest.mark.parametrize("joystick", [False, True], ids=["alone", "joystick first"])
@pytest.mark.parametrize("value", [0, 1, 2, 3, 4])
def test_the_kill_switch_lives_where_the_parameter_is_accepted(value: int, joystick: bool, tmp_path: Path) -> None:
    with started(tmp_path, value) as firmware:
        lives = kills(firmware, joystick)
    assert lives is (value == 0 or (value in (2, 3) and not joystick))
    (rule,) = (one for one in needed(Flavour.PX4, 255) if one.name == NAME)
    assert lives or not rule.takes(value), "accepted, and the switch is dead"


def what_forbids(port: int) -> str:
    """Return the driver's findings on the pad after it has read the parameter."""
    pilot = Pilot(port, "pymavlink", lambda vehicle: ((0.0, 0.0, 0.0), 0.0), {SYSTEM: "px4"})
    try:
        deadline, host = time.monotonic() + 20, pilot.hosts[0]
        turn = 0
        while time.monotonic() < deadline:
            pilot.turn(turn)
            turn += 1
            reason = host.watchdog.vehicle.not_ready
            if turn > 100 and (not reason or reason.startswith("parameter ")):
                return str(reason)
        raise AssertionError(f"{host.watchdog.vehicle}; {pilot.process.texts[-8:]}")
    finally:
        pilot.fleet.close()


def test_take_off_is_refused_until_setup_has_written_a_value_that_keeps_the_switch(tmp_path: Path) -> None:
    with started(tmp_path, 4) as firmware:
        reason = what_forbids(firmware.port)
        assert f"{NAME} is 4, needs 0" in reason and "kill" in reason
        assert set_up(firmware.port, {}) == [NAME]
        assert NAME not in what_forbids(firmware.port)
