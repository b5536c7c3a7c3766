"""Brings a vehicle from silence to full telemetry: requests streams, sets the origin, checks parameters. Pure.

WIRE (docs/reference/mavlink.md 1): ArduPilot streams nothing but heartbeats unless asked, one interval at a time; the
origin is ignored until its estimator runs, so it is repeated until GPS_GLOBAL_ORIGIN comes back. An origin that is
already set is neither changed nor reported, so it is requested as well. PX4 flies indoors without one: nothing waits
for its answer.
"""

import math
from collections import Counter, deque
from collections.abc import Mapping
from functools import partial

from drivers.mavlink import parameters
from drivers.mavlink.requests import Requests
from drivers.mavlink.settings import GlobalOrigin
from drivers.mavlink.stream_rates import StreamRates
from drivers.mavlink.wire import service, telemetry
from drivers.mavlink.wire.flight import command_to
from drivers.mavlink.wire.frames import Message, id_of
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT, Flavour, MavCmd
from drivers.mavlink.wire.parameters import value_from_carried
from groundstation.time_units import NEVER_NS, NS_PER_MS, NS_PER_S

_ORIGIN_PERIOD_NS = 3 * NS_PER_S
_PARAM_PERIOD_NS = 500 * NS_PER_MS
# Eight of them in the 2 s after which an ArduPilot without them lands: on a link that loses every fifth, some always
# arrive.
_HEARTBEAT_NS = 250 * NS_PER_MS
_DISCONNECTED_NS = 2 * NS_PER_S
# Several orders to land went unanswered by then; one that obeyed them does not pause any more (failsafe_transport.py).
_DEAF_NS = 3 * NS_PER_S
# Least time without a stream before it is requested again, in periods of its own.
_STREAM_NS, _PERIODS = 3 * NS_PER_S, 5
_SLOW_TOLD_NS = 30 * NS_PER_S
_PARAM_BURST = 4
_PARAM_TRIES = 20
_ORIGIN_TRIES_PX4 = 5
_CHECKED_WITH = "PX4 1.16 or ArduCopter 4.6 or 4.7"
_VERSION_PERIOD_NS, _VERSION_TRIES = NS_PER_S, 5
# After this many unanswered requests a parameter is also requested by its other names.
_ALIAS_AFTER = 3


class MavlinkSession:
    """The requests still to be made of one vehicle; starts over after a silence of 2 s, or when its clock began anew.

    problems: parameters that forbid a take-off. detail: the awaited step, or "". notes: for the operator; drained by
    the driver. tells_lost_transmitter: as far as is known. overrides: parameters set by the field file. pinned: the
    serial number of the only vehicle that may take off, "" for any. called: whether we call it at its address, rather
    than it us.
    """

    def __init__(
        self, system: int, flavour: Flavour, rates: dict[type[Message], float], our_system: int, origin: GlobalOrigin,
        overrides: Mapping[str, float] | None = None, pinned: str = "", called: bool = False,
    ) -> None:  # fmt: skip
        self._advice = "; if it calls this computer, it needs mavlink.listen: true" if called else ""
        self._pinned, self._serial_number = pinned.upper(), ""
        self._system, self._flavour, self._rates, self._origin = system, flavour, rates, origin
        self._needs = partial(parameters.needed, flavour, our_system, overrides)
        self._receives = False
        # Kept through a silence: a pilot who flies then is one still.
        self.tells_lost_transmitter = flavour is Flavour.PX4
        self._know(self._needs())
        self.notes: deque[str] = deque(maxlen=8)
        if warning := parameters.overridden(flavour, overrides or {}):
            self.notes.append(warning)
        self._version: parameters.Version | None = None
        self._version_tries = 0
        self._next_version_ns = 0
        self._connected = False
        self._found: dict[str, float] = {}
        self._comparison: tuple[list[str], list[str]] | None = None
        self._asked: set[str] = set()
        self._doubted: set[str] = set()
        self._param_tries: Counter[str] = Counter()
        self._stream_ns: dict[type[Message], int] = {}  # time of its last arrival or request
        self._rates_found = StreamRates(rates)
        self._again: list[type[Message]] = []
        self._slow_told_ns = -NEVER_NS
        self._has_origin = False
        self._origin_tries = 0
        self._next_origin_ns = self._next_param_ns = self._next_heartbeat_ns = 0

    def _know(self, needed: tuple[parameters.Needed, ...]) -> None:
        self._needed, self._by_name = needed, {name: n for n in needed for name in n.names}

    @property
    def problems(self) -> list[str]:
        """Return the faults of the parameters read so far."""
        return self._compared()[0]

    @property
    def unread(self) -> list[str]:
        """Return the parameters that have not been read yet."""
        return self._compared()[1]

    def _compared(self) -> tuple[list[str], list[str]]:
        if self._comparison is None:  # read at each turn, changed only by a value
            found = self._found
            read = [n for n in self._needed if not found.keys().isdisjoint(n.names)]
            faults = [text for n in read if (text := parameters.fault(n, found))]
            self._comparison = faults, [n.name for n in self._needed if found.keys().isdisjoint(n.names)]
        return self._comparison

    @property
    def unchecked(self) -> list[str]:
        """Return the missing parameters for which nothing waits: optional ones, and all of another version."""
        known = self._version is not None or self._version_tries >= _VERSION_TRIES
        another = known and not parameters.is_checked(self._flavour, self._version)
        missing = [name for name in self.unread if self._param_tries[name] >= _PARAM_TRIES]
        return [name for name in missing if another or self._by_name[name].optional]

    def detail(self, requests: Requests) -> str:
        """Return the pending step, or ""."""
        if not self._connected:
            return f"waiting for its heartbeat{self._advice}"
        if self._pinned and self._serial_number != self._pinned:
            number = self._serial_number or "not known"
            return f"it is another vehicle: its serial number is {number}, the field says {self._pinned}"
        missing = [kind for kind in self._rates if self._key(kind) not in requests.accepted]
        if missing:
            return f"asking for {missing[0].__name__.removesuffix('Message')}"
        waited_for = [name for name in self.unread if name not in self.unchecked]
        if waited_for:
            return self._unread_detail(waited_for[0])
        if self.problems:
            return f"parameter {self.problems[0]}: groundstation mavlink setup --apply"
        ready = self._has_origin or self._flavour is Flavour.PX4
        return "" if ready else "waiting for the origin to be taken"

    def _unread_detail(self, name: str) -> str:
        if self._param_tries[name] < _PARAM_TRIES:
            return f"reading parameter {name}"
        return f"it does not know parameter {name}: is its firmware {_CHECKED_WITH}?"

    def take(self, now_ns: int, kind: type[Message]) -> None:
        """Note that a message of a kind arrived; called on the reader's thread."""
        if kind in self._rates:
            self._stream_ns[kind] = now_ns
            self._rates_found.take(kind)

    @property
    def slow(self) -> str:
        """Return which stream comes more seldom than it was granted, or ""."""
        return self._rates_found.words

    def start_over(self, requests: Requests) -> None:
        """Forget requests and answers, for a vehicle that was silent or restarted."""
        if not self._connected:
            return
        self._connected, self._has_origin, self._origin_tries = False, False, 0
        self._found.clear()
        self._comparison = None
        self._param_tries.clear()
        self._stream_ns.clear()
        self._rates_found.start_over()
        self._again = []
        self._version, self._version_tries, self._serial_number = None, 0, ""
        requests.forget()

    def hear_parameter(self, message: service.ParamValue) -> None:
        """Take a parameter's value."""
        if message.param_id in self._by_name:
            value = value_from_carried(self._flavour, message.param_value, message.param_type)
            before = self._found.get(message.param_id, value)
            self._found[message.param_id], self._comparison = value, None
            if message.param_id == parameters.LOSS:
                self.tells_lost_transmitter = value != 0
            wanted = self._by_name[message.param_id]
            if value != before and not (math.isnan(value) and math.isnan(before)):
                self._note_change(wanted, message.param_id, before, value)
            self._note_doubtful(wanted, {message.param_id: value})

    def hear_transmitter(self) -> None:
        """Note that an ArduPilot receives a transmitter: it can, and has to, tell the loss of it."""
        if self._receives:
            return
        self._receives, self._comparison = True, None
        self._know(self._needs(receives=True))
        if parameters.LOSS in self._found:
            self._note_doubtful(self._by_name[parameters.LOSS], self._found)

    def _note_change(self, wanted: parameters.Needed, name: str, before: float, value: float) -> None:
        """Report a value that somebody else changed: autopilots report it on all their links."""
        need = wanted.under(name)
        needs = "" if need.takes(value) else f", needs {need.wish} ({need.reason})"
        self.notes.append(f"somebody changed its parameter {name} from {before:.7g} to {value:.7g}{needs}")

    def _note_doubtful(self, wanted: parameters.Needed, found: dict[str, float]) -> None:
        """Report once a value that permits flight but is not the best."""
        text = parameters.difference(wanted, found)
        if text and not parameters.fault(wanted, found) and wanted.name not in self._doubted:
            self._doubted.add(wanted.name)
            self.notes.append(f"parameter {text}: groundstation mavlink setup --apply")

    def hear_version(self, flight_sw_version: int, serial_number: str = "") -> None:
        """Take its serial number and firmware version; an unchecked version is noted."""
        self._serial_number = serial_number
        version = parameters.version_of(flight_sw_version)
        if version != self._version and not parameters.is_checked(self._flavour, version):
            text = f"its firmware is {version[0]}.{version[1]}: parameters were compared with {_CHECKED_WITH}"
            self.notes.append(f"{text}; those that it does not have are not checked")
        self._version = version

    @property
    def firmware(self) -> str:
        """Return its firmware and version, "" while unknown."""
        if self._version is None:
            return ""
        name = "PX4" if self._flavour is Flavour.PX4 else "ArduPilot"
        return f"{name} {'.'.join(map(str, self._version))}"

    def hear_origin(self) -> None:
        """Note that the origin is set."""
        self._has_origin = True

    def step(self, now_ns: int, silence_ns: int, requests: Requests, deaf_ns: int = 0) -> list[Message]:
        """Return the messages to send now; commands go through `requests`.

        deaf_ns: for so long it is to land, and nothing of it is heard: without our heartbeats an ArduPilot lands by
        itself.
        """
        messages: list[Message] = []
        withheld = self._flavour is Flavour.ARDUPILOT and deaf_ns > _DEAF_NS
        if now_ns >= self._next_heartbeat_ns and not withheld:
            self._next_heartbeat_ns = now_ns + _HEARTBEAT_NS
            messages.append(telemetry.OUR_HEARTBEAT)
        if silence_ns > _DISCONNECTED_NS:
            self.start_over(requests)
            return messages
        self._connected, self._advice = True, ""
        kind = next((one for one in self._rates if self._key(one) not in requests.accepted), None)
        self._note_slow(now_ns)
        if (kind := kind or self._ended(now_ns) or self._next_slow(requests)) is not None:
            # WIRE (SET_MESSAGE_INTERVAL): microseconds; -1 stops the stream.
            interval_us = 1e6 / rate_hz if (rate_hz := self._rates[kind]) > 0.0 else -1.0
            requests.ask(now_ns, self._key(kind), MavCmd.SET_MESSAGE_INTERVAL, float(id_of(kind)), interval_us)
            self._stream_ns[kind] = now_ns
        return messages + self._service(now_ns)

    def _ended(self, now_ns: int) -> type[Message] | None:
        """Return a stream that was granted but does not come: the grant was meant for others, or withdrawn."""
        for kind, rate_hz in self._rates.items():
            patience_ns = max(_STREAM_NS, round(_PERIODS * NS_PER_S / rate_hz)) if rate_hz > 0.0 else NEVER_NS
            if now_ns - self._stream_ns.get(kind, now_ns) > patience_ns:
                return kind
        return None

    def _note_slow(self, now_ns: int) -> None:
        self._again += self._rates_found.step(now_ns)
        if self.slow and now_ns - self._slow_told_ns > _SLOW_TOLD_NS:
            self._slow_told_ns = now_ns
            self.notes.append(f"{self.slow}: another station changed its rates, or the link carries no more")

    def _next_slow(self, requests: Requests) -> type[Message] | None:
        ready = bool(self._again) and not any(requests.is_open(self._key(kind)) for kind in self._rates)
        return self._again.pop(0) if ready else None

    def _service(self, now_ns: int) -> list[Message]:
        messages: list[Message] = []
        given_up = self._flavour is Flavour.PX4 and self._origin_tries >= _ORIGIN_TRIES_PX4
        if not self._has_origin and not given_up and now_ns >= self._next_origin_ns:
            self._next_origin_ns = now_ns + _ORIGIN_PERIOD_NS
            self._origin_tries += 1
            messages += self._origin_requests()
        messages += self._version_request(now_ns)
        unread = [name for name in self.unread if name not in self.unchecked]
        if unread and (now_ns >= self._next_param_ns or self._asked.isdisjoint(unread)):
            self._next_param_ns = now_ns + _PARAM_PERIOD_NS
            # A burst at a time, so that a slow radio is not flooded; answers trigger the next one.
            burst = sorted(unread, key=self._param_tries.__getitem__)[:_PARAM_BURST]
            messages += [
                service.ParamRequestRead(self._system, AUTOPILOT_COMPONENT, self._asked_as(name), -1) for name in burst
            ]
            self._param_tries.update(burst)
            if left_out := [name for name in burst if name in self.unchecked]:
                self.notes.append(f"not checked, because its firmware does not know them: {', '.join(left_out)}")
            self._asked = set(burst)
        return messages

    def _asked_as(self, name: str) -> str:
        names, tries = self._by_name[name].names, self._param_tries[name]
        return names[tries % len(names)] if tries >= _ALIAS_AFTER else name

    def _version_request(self, now_ns: int) -> list[Message]:
        tried = self._version_tries >= _VERSION_TRIES and not self._pinned
        if self._version is not None or tried or now_ns < self._next_version_ns:
            return []
        self._version_tries += 1
        self._next_version_ns = now_ns + _VERSION_PERIOD_NS
        asked = float(id_of(telemetry.AutopilotVersion))
        return [command_to(self._system, MavCmd.REQUEST_MESSAGE, asked)]

    def _origin_requests(self) -> list[Message]:
        o = self._origin
        place = (round(o.latitude_deg * 1e7), round(o.longitude_deg * 1e7), round(o.altitude_m * 1000))
        asked = float(id_of(telemetry.GpsGlobalOrigin))
        # Not through the requests: "denied" here means "none yet", which is no news.
        return [
            service.SetGpsGlobalOrigin(self._system, *place),
            command_to(self._system, MavCmd.REQUEST_MESSAGE, asked),
        ]

    @staticmethod
    def _key(kind: type[Message]) -> str:
        return f"stream {kind.__name__.removesuffix('Message')}"
