"""Orders a hosted team to take off and to track, in place of the operator and without its checks."""

from collections.abc import Mapping

from drivers.host import VehicleHost
from drivers.watchdog_types import DriverMode
from groundstation.bus.messages import Command, Lease, Verb
from groundstation.bus.topics import COMMAND, LEASE
from groundstation.time_units import NS_PER_MS
from sim_bridge.study.faults.local_bus import LocalBus

_HOLDER, _TEAM = "operator", "team"
_PERIOD_NS, _LIFE_NS = 500 * NS_PER_MS, 1_500 * NS_PER_MS


class TeamOrders:
    """Renews the lease; orders TAKEOFF until all fly, then TRACK once. tracking: whether TRACK was ordered."""

    def __init__(self, bus: LocalBus) -> None:
        self.tracking = False
        self._bus, self._next_ns = bus, 0

    def step(self, now_ns: int, hosts: Mapping[str, VehicleHost]) -> None:
        """Send what is due."""
        if now_ns < self._next_ns:
            return
        self._next_ns = now_ns + _PERIOD_NS
        expires_ns = now_ns + _LIFE_NS
        self._bus.publish(LEASE, Lease(header=self._bus.header(_TEAM), holder=_HOLDER, expires_ns=expires_ns))
        if self.tracking:
            return
        modes = {name: host.watchdog.mode for name, host in hosts.items()}
        standing = tuple(name for name, mode in modes.items() if mode is DriverMode.LANDED)
        if standing:
            self._order(Verb.TAKEOFF, standing, now_ns)
        elif all(mode is DriverMode.HOVER for mode in modes.values()):
            self.tracking = True
            self._order(Verb.TRACK, tuple(hosts), now_ns)

    def land(self, now_ns: int, hosts: Mapping[str, VehicleHost]) -> None:
        """Order LAND once."""
        self._order(Verb.LAND, tuple(hosts), now_ns)

    def _order(self, verb: Verb, scope: tuple[str, ...], now_ns: int) -> None:
        header, expires_ns = self._bus.header(_TEAM), now_ns + 10 * _PERIOD_NS
        identity = f"{verb}-{now_ns}"
        self._bus.publish(
            COMMAND,
            Command(header=header, id=identity, verb=verb, scope=scope, issuer=_HOLDER, expires_ns=expires_ns),
        )
