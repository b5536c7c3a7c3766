"""The console process of a run. Started as `groundstation.console.process:run`; `groundstation console` serves too."""

import asyncio

import msgspec

from groundstation.bus.messages import Severity
from groundstation.console.scene import scene_from_field
from groundstation.console.section import ConsoleSection, port_of
from groundstation.console.server import ConsoleServer, claim_port
from groundstation.errors import GroundStationError
from groundstation.monitor.state import cast_from_field
from groundstation.process.child import Child


def run(child: Child) -> int:
    """Serve the page until asked to stop or until the supervisor is gone."""
    try:
        section = msgspec.json.decode(child.section, type=ConsoleSection)
        field = msgspec.json.decode(section.field)
    except msgspec.DecodeError as error:
        raise GroundStationError(f"the console's section is malformed: {error}") from error
    wanted = port_of(section.field)
    listener = claim_port(wanted)
    server = ConsoleServer(
        child.bus, cast_from_field(section.field), scene_from_field(field, section.truth), field, listener
    )
    _announce(child, server.url, listener.getsockname()[1], wanted)

    def go_on(turns: int, late: int) -> bool:
        child.beat()
        child.tick_status(turns, late, server.overflowed)
        return not child.stop_requested and child.supervisor_alive

    asyncio.run(server.serve(go_on))
    return 0


def _announce(child: Child, url: str, port: int, wanted: int) -> None:
    child.ready(url)
    if port == wanted:
        child.event(Severity.INFO, f"console at {url}")
    else:
        remedy = "another run may use it; set console.port to choose"
        child.event(Severity.WARNING, f"port {wanted} is in use: console at {url}", remedy)
