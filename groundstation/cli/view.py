"""`groundstation view`: live engineering views of a run, in Rerun, Foxglove or ROS 2 tools."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.monitor import choose

if TYPE_CHECKING:
    from collections.abc import Mapping

    from groundstation.engineering_views.watch import LiveView
    from groundstation.field.resolved import ResolvedField
    from groundstation.supervisor.runtime_file import RuntimeRecord

_FOXGLOVE_PORT = 8766
_RERUN_PORT = 9876
_RERUN_PAGE_PORT = 9090
_ROS_ROUTER = "tcp/127.0.0.1:7447"
_ROS_DISTRIBUTIONS = ("humble", "jazzy", "lyrical")
_PORT = click.IntRange(1024, 65535)
# Longer than a viewer needs for its own end (two steps of 2 s).
_GOODBYE_S = 8.0


@click.command(
    epilog="\b\nExamples:\n  groundstation view --foxglove          then open ws://127.0.0.1:8766 in Foxglove\n"
    "  groundstation view --rerun             then open the page that it names\n"
    "  groundstation view --rerun -o flight.rrd\n"
    "  groundstation view --ros2              then ros2 topic list, rviz2 ... (rmw_zenoh)"
)
@click.option("--rerun", "viewer", flag_value="rerun", help="Serve Rerun's web viewer; extra [rerun].")
@click.option("--foxglove", "viewer", flag_value="foxglove", help="Serve Foxglove and Lichtblick; extra [foxglove].")
@click.option("--ros2", "viewer", flag_value="ros2", help="Publish to a ROS 2 Zenoh router; extra [ros2].")
@click.option("--run", "name", metavar="NAME", help="The run to show, if there are several.")
@click.option("--port", type=_PORT, help=f"Port to serve on (Foxglove: {_FOXGLOVE_PORT}, Rerun: {_RERUN_PORT}).")
@click.option("--page-port", type=_PORT, default=_RERUN_PAGE_PORT, show_default=True, help="Port of Rerun's page.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Rerun: write a new file instead of serving.")
@click.option(
    "--router", default=_ROS_ROUTER, show_default=True, metavar="ENDPOINT", help="ROS 2: endpoint of its Zenoh router."
)
@click.option("--domain", type=click.IntRange(0, 232), default=0, show_default=True, help="ROS 2: domain.")
@click.option(
    "--distro", type=click.Choice(_ROS_DISTRIBUTIONS), default="jazzy", show_default=True, help="ROS 2: distribution."
)
@click.option("--truth", is_flag=True, help="ROS 2: show the true states of a simulation too.")
def view(
    viewer: str | None, name: str | None, port: int | None, page_port: int, output: Path | None, **ros2: Any
) -> int:
    """Show a running ground station in an engineering viewer, on loopback. It takes no commands and stops nothing."""
    from groundstation.bus.roles import Role
    from groundstation.engineering_views.watch import watch
    from groundstation.process.leaving import LeavingSignal, leave_within
    from groundstation.supervisor.joining import join

    if viewer is None:
        raise click.UsageError("say which viewer: --rerun, --foxglove or --ros2")
    if output is not None and viewer != "rerun":
        raise click.UsageError("--output goes with --rerun; a recording opens in Foxglove as it is")
    _require(viewer)
    leaving = LeavingSignal()
    leaving.install()
    record = choose(name)
    bus = join(record, "view", Role.VIEW, at_most_hz=_thinned(record) if viewer == "ros2" else {})
    shown: LiveView | None = None
    try:
        opened = _open_ros2(record, **ros2) if viewer == "ros2" else None
        shown = opened or _open(viewer, record, port, page_port, output)
        dropped = watch(bus, shown, lambda: record.alive and not leaving.requested)
        return _ended(leaving.requested, shown.alive, dropped)
    finally:
        leave_within(_GOODBYE_S, ExitCode.OK if leaving.requested else ExitCode.FAULT)
        bus.close()
        if shown is not None:
            shown.close()


def _ended(left: bool, served: bool, dropped: int) -> ExitCode:
    if not left:
        click.echo("the run has ended" if served else "the viewer's server has ended", err=True)
    if dropped:
        click.echo(f"{dropped} samples were dropped: this machine is too slow to show all", err=True)
    return ExitCode.OK if left or served else ExitCode.FAULT


def _require(viewer: str) -> None:
    from groundstation.engineering_views.extras import require_foxglove, require_rerun, require_ros2

    {"rerun": require_rerun, "foxglove": require_foxglove, "ros2": require_ros2}[viewer]()


def _open(viewer: str, record: "RuntimeRecord", port: int | None, page_port: int, output: Path | None) -> "LiveView":
    from groundstation.bus import clock
    from groundstation.recording.timeline import Timeline

    field, timeline = _field_of(record), Timeline(clock.clock_id(), clock.unix_offset_ns())
    if viewer == "foxglove":
        from groundstation.engineering_views.foxglove_live import FoxgloveView

        foxglove = FoxgloveView(record.name, field, timeline, port or _FOXGLOVE_PORT)
        click.echo(f"{record.name} at {foxglove.address} (Ctrl-C leaves it; the flight goes on)")
        return foxglove
    from groundstation.engineering_views.rerun_live import RerunServer, RerunView
    from groundstation.recording.outputs import require_absent

    if output is not None:
        require_absent(output)
    server = None if output is not None else RerunServer(port or _RERUN_PORT, page_port)
    click.echo(f"{record.name} {f'to {output}' if server is None else f'at {server.page}'} (Ctrl-C leaves it)")
    now_ns = clock.now_ns() + timeline.unix_offset_ns
    return RerunView(record.name, field, timeline, now_ns, server, output)


def _open_ros2(record: "RuntimeRecord", router: str, domain: int, distro: str, truth: bool) -> "LiveView":
    from groundstation.bus import clock
    from groundstation.engineering_views.ros2 import LAYOUTS
    from groundstation.engineering_views.ros2.live import Ros2View
    from groundstation.recording.timeline import Timeline

    timeline = Timeline(clock.clock_id(), clock.unix_offset_ns())
    bridge = Ros2View(router, domain, distro, _field_of(record), timeline, truth)
    click.echo(f"{record.name} in ROS 2 domain {domain} by {router} (Ctrl-C leaves it; the flight goes on)")
    click.echo(f"layouts for RViz and Foxglove: {LAYOUTS}")
    return bridge


def _thinned(record: "RuntimeRecord") -> "Mapping[str, float]":
    from groundstation.bus.zenoh_bus import speak_on_one_thread
    from groundstation.engineering_views.ros2.live import enough_hz

    speak_on_one_thread()
    return enough_hz(record.site, _field_of(record))


def _field_of(record: "RuntimeRecord") -> "ResolvedField | None":
    """Return the resolved field from the present recording, or None."""
    from groundstation.engineering_views.field import field_of
    from groundstation.recording.preamble import FIELD_NAME
    from groundstation.recording.reader import attached_field

    return field_of({FIELD_NAME: attached_field(Path(record.run_dir))})
