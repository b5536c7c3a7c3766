"""The interface that a vehicle driver implements (the host does the rest), and the input of a driver process."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

from pydantic import BaseModel, ValidationError

from drivers.plausibility.clock_drift import ClockFigures
from drivers.watchdog_types import VehicleView, WatchdogDecision
from groundstation.bus.api import Bus
from groundstation.bus.messages import Severity
from groundstation.errors import SettingsError

_Settings = TypeVar("_Settings", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class LinkHealth:
    """State of a driver's link; rejected: datagrams dropped, by reason; clock: None if no time is reported.

    firmware: of the vehicle, with its version; "": unknown. asks_time: whether it requests our time; None: it need not.
    """

    link_quality: float | None = None
    rate_hz: float = 0.0
    rejected: dict[str, int] = field(default_factory=dict)
    detail: str = ""
    clock: ClockFigures | None = None
    firmware: str = ""
    asks_time: bool | None = None


class Vehicle(Protocol):
    """One vehicle behind its protocol. All methods are called from the sender loop and never block.

    A driver reads its link in a thread of its own and publishes ODOMETRY and IMU from there.
    """

    name: str
    address: str

    def view(self, now_ns: int) -> VehicleView:
        """Return the vehicle's last report, and whether it is fresh."""

    def apply(self, now_ns: int, decision: WatchdogDecision) -> None:
        """Send the vehicle its command; called at the sender's rate, also while it is silent."""

    def health(self, now_ns: int) -> LinkHealth:
        """Return the state of the link for the status message."""

    def flush(self) -> None:
        """Publish batched data (raw datagrams); called 10 times a second."""

    def close(self) -> None:
        """Stop the reader and close the link."""


class HostProcess(Protocol):
    """The process as a driver needs it; `groundstation.process.child.Child` is one."""

    name: str
    section: str
    bus: Bus

    @property
    def stop_requested(self) -> bool:
        """Return whether SIGTERM came: land, then exit."""

    @property
    def supervisor_alive(self) -> bool:
        """Return whether the supervisor lives; if not, hover, land, exit."""

    @property
    def supervisor_fresh(self) -> bool:
        """Return whether the supervisor is responsive; False while it is frozen."""

    @property
    def spoken_for_ns(self) -> int:
        """Return for how long others have commanded a hover in this driver's place [ns]; 0: nobody does."""

    def beat(self) -> None:
        """Signal that the main loop turns."""

    def ready(self, detail: str = "") -> None:
        """Report that the start is finished."""

    def degrade(self, detail: str, works: bool = True) -> None:
        """Report that something is missing; works: False before the vehicle was heard, so that others go on for it."""

    def tick_status(self, ticks: int = 0, overruns: int = 0, overflowed: int = 0) -> None:
        """Publish the process status when due."""

    def sleep_until(self, deadline_ns: int) -> bool:
        """Sleep until a time of the bus's clock [ns] or `wake`; False if a stop or the supervisor's death ended it."""

    def wake(self) -> None:
        """End a sleep early, the one under way or the next; from any thread."""

    def note_addresses(self, addresses: Sequence[tuple[str, int]]) -> None:
        """Record the last addresses of vehicles that call us, for the process that commands them after this one."""

    def finish(self) -> None:
        """Record that no vehicle of this process needs anybody; without it others land them after its end."""

    def leave(self, number: int) -> None:
        """Record a number (0 to 2^62) for the process that commands the vehicles after this one."""

    def event(self, severity: Severity | str, text: str, remedy: str = "", entity: str | None = None) -> None:
        """Publish an event."""


def read_section(model: type[_Settings], text: str, driver: str) -> _Settings:
    """Return the settings of the named driver from JSON; raises SettingsError with a line for each mistake."""
    try:
        return model.model_validate_json(text)
    except ValidationError as error:
        problems = [f"{driver}: {'.'.join(map(str, p['loc']))}: {p['msg']}" for p in error.errors()]
        raise SettingsError(problems) from None
