"""The console process of a run. Started as `groundstation.console.process:run`; `groundstation console` serves too."""

import asyncio
from pathlib import Path

import msgspec

from groundstation.bus.clock import now_ns
from groundstation.bus.messages import Severity
from groundstation.console.devices import Devices
from groundstation.console.network import Network
from groundstation.console.room import scene_from_field
from groundstation.console.run_end import read_end
from groundstation.console.section import ConsoleSection, devices_of, run_id
from groundstation.console.server import HOST, RATE_HZ, ConsoleServer, claim_port
from groundstation.errors import GroundStationError
from groundstation.field.behaviour import ConsoleValues
from groundstation.monitor.state import cast_from_field
from groundstation.process.child import Child
from groundstation.process.ports import holder_of
from groundstation.process.refusals import Refusals
from groundstation.time_units import NS_PER_MS

# The signal to stop may overtake the event that the run ends.
_OVERTAKEN_NS = 500 * NS_PER_MS
_INTRUSIONS = {
    "other_site": "requests of other web sites",
    "other_user": "requests of other users without the code",
    "device": "requests of devices that were not invited",
    "silent": "connections that asked for nothing",
    "crowd": "connections beyond those that one address may have",
}


def run(child: Child) -> int:
    """Serve the page until asked to stop or until the supervisor is gone."""
    try:
        section = msgspec.json.decode(child.section, type=ConsoleSection)
    except msgspec.DecodeError as error:
        raise GroundStationError(f"the console's section is malformed: {error}") from error
    field = section.field
    wanted = field.console.port
    listener = claim_port(wanted)
    cast, scene = cast_from_field(field), scene_from_field(field, section.truth)
    network = _network(child, field.console)
    server = ConsoleServer(child.bus, cast, scene, field, listener, run_id(section.run_dir), network=network)
    _announce(child, server.url, listener.getsockname()[1], wanted)

    intrusions, leaves_ns = Refusals(_INTRUSIONS), 0

    def go_on(turns: int, late: int) -> bool:
        nonlocal leaves_ns
        child.beat()
        server.closed = child.run_ends
        child.tick_status(turns, late, server.overflowed)
        if turns % RATE_HZ == 0 and (refused := intrusions.news(now_ns(), server.refused)):
            child.event(Severity.WARNING, f"the console refused {refused}")
        if not child.stop_requested or not child.supervisor_alive:
            return child.supervisor_alive
        leaves_ns = leaves_ns or now_ns() + _OVERTAKEN_NS
        return not server.ended and now_ns() < leaves_ns

    asyncio.run(server.serve(go_on, lambda: read_end(Path(section.run_dir))))
    return 0


def _network(child: Child, values: ConsoleValues) -> Network | None:
    """Return the access of devices, if the field has one; without it only the page on loopback is served."""
    if not values.listen or child.spec.identity is None:
        return None
    devices = Devices(devices_of(child.spec.identity.folder))
    try:
        network = Network.over(claim_port(values.port, values.listen), devices)
    except GroundStationError as error:
        child.event(Severity.ERROR, f"the console is not there for devices: {error}", "mend console.listen")
        return None
    child.event(Severity.INFO, f"console for invited devices at {devices.url}", "groundstation console --invite stop")
    return network


def _announce(child: Child, url: str, port: int, wanted: int) -> None:
    child.ready(url)
    if port == wanted:
        child.event(Severity.INFO, f"console at {url}")
    else:
        text = f"port {wanted} is taken by {holder_of(HOST, wanted)}: console at {url}"
        child.event(Severity.WARNING, text, "set console.port to choose another one")
