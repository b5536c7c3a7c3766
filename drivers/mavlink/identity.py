"""Identifies a vehicle by its firmware, and by the number that its autopilot's maker gave it. Pure."""

from drivers.mavlink.latest_telemetry import HEARTBEAT_NS
from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.telemetry import AutopilotVersion
from groundstation.time_units import NEVER_NS, NS_PER_MS

# More than a second, in which a heartbeat is due.
_SILENT_NS = 1_200 * NS_PER_MS
_WORDS = {Flavour.PX4: "a PX4", Flavour.ARDUPILOT: "an ArduPilot"}


def other_flavour(autopilot: int, flavour: Flavour) -> str:
    """Return that a vehicle is another kind than the field file says, with the remedy; "" if it is not."""
    if autopilot == flavour:
        return ""
    words = {kind.value: text for kind, text in _WORDS.items()}
    found = words.get(autopilot, f"neither a PX4 nor an ArduPilot (autopilot {autopilot})")
    remedy = ": set mavlink.flavour" if autopilot in words else ""
    return f"it is {found}, the field says {flavour.name.lower()}{remedy}"


def serial_number_of(version: AutopilotVersion) -> str:
    """Return the number as hexadecimal digits, "" if the autopilot has none.

    WIRE (AUTOPILOT_VERSION): uid2 is the number where it is not all zero, in the order of its bytes; else uid is.
    """
    if any(version.uid2):
        return bytes(version.uid2).hex().upper()
    return f"{version.uid:016X}" if version.uid else ""


class Namesakes:
    """Whether other senders use a vehicle's system id now: nobody knows which of them would obey."""

    def __init__(self, system: int) -> None:
        self._system, self._count, self._counted_ns = system, 0, -NEVER_NS

    def words(self, now_ns: int, doubled: int) -> str:
        """Return the fault with its remedy, or ""; doubled: frames with the id from a second address so far."""
        if doubled > self._count:
            self._count, self._counted_ns = doubled, now_ns
        if now_ns - self._counted_ns >= HEARTBEAT_NS:
            return ""
        fault = f"a second address sends with its system id {self._system}"
        return f"{fault}: set an id of its own on each vehicle, or close one of the ways by which this one sends"


class Misfit:
    """Why the frames of a vehicle that does not count as heard are of no use, by its heartbeats of the last seconds."""

    def __init__(self, flavour: Flavour, system: int) -> None:
        self._flavour, self._system = flavour, system
        self._told: tuple[int, str] | None = None
        self._stranger: tuple[int, int] | None = None
        self._strangers: dict[int, int] = {}  # when each was heard first
        self._heard_ns: int | None = None

    def take(self, now_ns: int, autopilot: int) -> str:
        """Take a heartbeat; return that it is another kind than the field file says, with the remedy, or ""."""
        self._told, self._heard_ns = (now_ns, other_flavour(autopilot, self._flavour)), now_ns
        return self._told[1]

    def take_old(self, now_ns: int) -> None:
        """Take a frame of MAVLink 1, which some vehicles send until they are greeted, and routers among others."""
        if self._told is None or self._told[1] or now_ns - self._told[0] > HEARTBEAT_NS:
            self._told = now_ns, "it speaks MAVLink 1 only: set version 2 on it"

    def take_stranger(self, now_ns: int, system: int) -> None:
        """Take a heartbeat of an autopilot of this link whose system id the field file does not have."""
        first_ns = self._strangers.setdefault(system, now_ns)
        if self._heard_ns is None or first_ns > self._heard_ns:  # one that was there already is another vehicle
            self._stranger = now_ns, system

    def words(self, now_ns: int) -> str:
        """Return the reason, "" if there is none."""
        if self._told is not None and now_ns - self._told[0] < HEARTBEAT_NS and (self._told[1] or not self._stranger):
            return self._told[1]
        if self._stranger is None or now_ns - self._stranger[0] >= HEARTBEAT_NS:
            return ""
        if self._heard_ns is not None:
            silent = self._strangers[self._stranger[1]] > self._heard_ns and now_ns - self._heard_ns > _SILENT_NS
            changed = f"system {self._stranger[1]} answers since it fell silent: was its system id changed?"
            return changed if silent else ""
        return f"system {self._stranger[1]} answers here, the field says {self._system}: set mavlink.system_id"
