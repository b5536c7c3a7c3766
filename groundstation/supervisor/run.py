"""A run's name and place, as given to its supervisor."""

from dataclasses import dataclass
from pathlib import Path

from groundstation.bus.roles import Identity

SOURCE = "supervisor"


@dataclass(frozen=True, slots=True)
class Run:
    """A run. real: the drones that exist.

    listen: address at which the router serves other hosts of the site, "" for none. source, identity, clock: name,
    certificate and clock of the supervisor of another host's devices.
    """

    site: str
    field: str
    endpoint: str
    run_dir: Path
    drones: tuple[str, ...]
    real: tuple[str, ...] = ()
    listen: str = ""
    source: str = SOURCE
    identity: Identity | None = None
    clock: str = ""

    @property
    def name(self) -> str:
        """Return the run's name in orders and leases."""
        return self.run_dir.name

    @property
    def guarded(self) -> bool:
        """Return whether its bus admits only its own members."""
        return self.endpoint.startswith("tls/")

    @property
    def makes_identities(self) -> bool:
        """Return whether the certificates of its members are made at its start: on its own host."""
        return self.guarded and self.identity is None
