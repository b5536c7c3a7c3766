"""Reads the parameters for indoor flight, lists each difference, and writes them on request."""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial

from drivers.mavlink.greeting import calls_us, first_heartbeat
from drivers.mavlink.identity import other_flavour
from drivers.mavlink.links.seam import MavlinkLink
from drivers.mavlink.parameters import Needed, difference, needed
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.flight import command_to
from drivers.mavlink.wire.frames import id_of
from drivers.mavlink.wire.names import ARMED, AUTOPILOT_COMPONENT, Flavour, MavCmd, SensorBits
from drivers.mavlink.wire.parameters import carried_from_value, value_from_carried
from drivers.mavlink.wire.service import ParamRequestRead, ParamSet, ParamValue
from drivers.mavlink.wire.telemetry import SysStatus
from groundstation.errors import DriverError

_TRIES = 5
_ANSWER_S = 0.6
_CONNECT_S = 5.0


@dataclass(frozen=True, slots=True)
class ParameterDifference:
    """One parameter with a wrong value; found None: the vehicle does not report it."""

    wanted: Needed
    found: float | None
    text: str


class ParameterSetup:
    """The parameters of one vehicle on an open link without another reader; settings: those of the link, if known."""

    def __init__(
        self, link: MavlinkLink, system: int, flavour: Flavour, our_system: int,
        overrides: Mapping[str, float] | None = None, settings: LinkSettings | None = None,
    ) -> None:  # fmt: skip
        self._link, self._system, self._flavour, self._settings = link, system, flavour, settings
        self._needed = partial(needed, flavour, our_system, overrides)
        # From its answer: the name, and the encoding.
        self._answers: dict[str, ParamValue] = {}

    def connect(self) -> None:
        """Wait for the vehicle; raises DriverError if it does not answer, is another kind, or has its motors on."""
        others: set[int] = set()
        heartbeat = first_heartbeat(self._link, self._system, _CONNECT_S, others)
        if heartbeat is None:
            raise DriverError(self._unanswered(others))
        if foreign := other_flavour(heartbeat.autopilot, self._flavour):
            raise DriverError(f"system {self._system}: {foreign}")
        if heartbeat.base_mode & ARMED:
            raise DriverError(f"system {self._system} is armed: parameters are not touched")

    def _unanswered(self, others: set[int]) -> str:
        if others:
            there = " and ".join(map(str, sorted(others)))
            return (
                f"system {self._system} does not answer, system {there} does: set mavlink.system_id in the field file"
            )
        if self._settings is not None and calls_us(self._settings, self._system):
            return (
                f"system {self._system} does not answer at {self._settings.target}, but calls this computer: "
                "set mavlink.listen to true in the field file"
            )
        heard = ", ".join(f"{reason} {n}" for reason, n in self._link.rejected.items())
        refused = f" (refused: {heard})" if heard else ""
        link = f" {self._settings.target}" if self._settings is not None else ""
        return (
            f"system {self._system} does not answer{refused}; `groundstation mavlink probe{link}` tells who is on "
            "that link, and one that is heard at udpin:0.0.0.0:14550 only needs mavlink.listen: true"
        )

    def differences(self) -> Iterator[ParameterDifference]:
        """Yield the differences from the needed values."""
        for wanted in self._needed(self._flavour is Flavour.ARDUPILOT and self._receives()):
            name, value = self._read(wanted)
            text = difference(wanted, {} if value is None else {name: value})
            if text and not (value is None and wanted.optional):
                yield ParameterDifference(wanted.under(name).mending(value), value, text)

    def _receives(self) -> bool:
        """Return whether the vehicle reports that it has heard a transmitter since its start."""
        # WIRE (GCS.cpp): an ArduPilot's receiver is present from the transmitter's first word on, and healthy until
        # the failsafe of FS_THR_ENABLE.
        asked = command_to(self._system, MavCmd.REQUEST_MESSAGE, float(id_of(SysStatus)))
        for _ in range(_TRIES):
            self._link.send(self._system, asked)
            deadline = time.monotonic() + _ANSWER_S
            while time.monotonic() < deadline:
                for _, frame in self._link.receive():
                    if frame.system == self._system and isinstance(frame.message, SysStatus):
                        return bool(frame.message.onboard_control_sensors_present & SensorBits.RC_RECEIVER)
        return False

    def apply(self, wanted: Needed) -> bool:
        """Write one parameter; returns whether the vehicle confirmed it."""
        known = self._answers.get(wanted.name)
        name, kind = (wanted.name, wanted.kind) if known is None else (known.param_id, known.param_type)
        carried = carried_from_value(self._flavour, wanted.value, kind)
        value = self._exchange(wanted, ParamSet(self._system, AUTOPILOT_COMPONENT, name, carried, kind), _TRIES)
        return value is not None and not difference(wanted, {wanted.name: value})

    def _read(self, wanted: Needed) -> tuple[str, float | None]:
        """Return the name that it answers to, and its value, None if to none."""
        for tries in (1, _TRIES - 1):
            for name in wanted.names:
                value = self._exchange(wanted, ParamRequestRead(self._system, AUTOPILOT_COMPONENT, name, -1), tries)
                if value is not None:
                    return name, value
        return wanted.name, None

    def _exchange(self, wanted: Needed, message: ParamRequestRead | ParamSet, tries: int) -> float | None:
        for _ in range(tries):
            self._link.send(self._system, message)
            deadline = time.monotonic() + _ANSWER_S
            while time.monotonic() < deadline:
                for _, frame in self._link.receive():
                    answer = frame.message
                    if frame.system != self._system or not isinstance(answer, ParamValue):
                        continue
                    if answer.param_id == message.param_id:
                        self._answers[wanted.name] = answer
                        return value_from_carried(self._flavour, answer.param_value, answer.param_type)
        return None
