"""The roles of a run's members, as the table of topics and the access control name them."""

from dataclasses import dataclass
from enum import StrEnum


class Role(StrEnum):
    """Purpose of a member of the bus."""

    SUPERVISOR = "supervisor"
    """The run's main process: watches the others, and contains the operator."""
    TRACKER = "tracker"
    """Estimates and plans."""
    DRIVER = "driver"
    """Serves its vehicles."""
    CAMERA = "camera"
    """Serves one camera."""
    TARGET = "target"
    """Reports one target's own motion."""
    DIAGNOSIS = "diagnosis"
    """Reports which figure of the field is wrong."""
    RECORDER = "recorder"
    """Writes the recording."""
    CONSOLE = "console"
    """Serves the operator's page."""
    MONITOR = "monitor"
    """Draws on the operator's terminal."""
    SIM_BRIDGE = "sim_bridge"
    """Emulates devices and publishes the truth."""
    LIAISON = "liaison"
    """Communicates with one other host, for the supervisor."""
    HOST = "host"
    """Runs devices of the field on another host."""
    CLI = "cli"
    """A command in another shell."""
    VIEW = "view"
    """Subscribes only."""


DEVICES = frozenset({Role.DRIVER, Role.CAMERA, Role.TARGET})
"""Roles that publish about their own vehicles, cameras and targets only."""
WITNESSES = frozenset({Role.RECORDER, Role.CONSOLE, Role.MONITOR, Role.SIM_BRIDGE, Role.VIEW})
"""Roles that may receive ground truth and the simulator's messages; none of them estimates or flies."""
PROCESSES = frozenset(Role) - {Role.CLI, Role.VIEW}
"""Roles of the processes that a run starts."""


@dataclass(frozen=True, slots=True)
class Member:
    """One certificate of a run, with its role and member.

    name: the certificate's common name; a certificate with several roles is several members. sources: permitted
    sources of its messages, key chunks in which `$*` stands for any ending. entities: subjects of a device's messages.
    """

    name: str
    role: Role
    sources: tuple[str, ...]
    entities: tuple[str, ...] = ()


def shell(role: Role) -> str:
    """Return the name in the certificate that programs of a role share which join from another shell."""
    return f"{role}-shell"  # no process can be called so: its name has no hyphen


def certificate_name(host: str) -> str:
    """Return the name in the certificate of an admitted host."""
    return f"host-{host}"


SHELLS = (
    Member(shell(Role.CLI), Role.CLI, ("cli_$*", "deadman_$*")),
    Member(shell(Role.CONSOLE), Role.CONSOLE, ("console_$*",)),
    Member(shell(Role.VIEW), Role.VIEW, ("view_$*", "monitor_$*")),
)
"""Members as which the owner of a run may join it from any shell."""


@dataclass(frozen=True, slots=True)
class Identity:
    """The means to join: the folder of the run's certificates, and the name in the process's own.

    run: name of the run; an order carries it.
    """

    folder: str
    name: str
    run: str
