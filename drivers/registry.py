"""Kinds of drivers and where each begins. A new kind is a package with `driver.run(child)` and one line here."""

from groundstation.errors import DriverError

ENTRY_POINTS: dict[str, str] = {
    "ardrone": "drivers.ardrone.driver:run",
    "mavlink": "drivers.mavlink.driver:run",
    "camera": "drivers.camera.driver:run",
}


def entry_point(kind: str) -> str:
    """Return "module:function" of a kind of driver; raises DriverError naming the kinds there are."""
    try:
        return ENTRY_POINTS[kind]
    except KeyError:
        raise DriverError(f"kind: {kind} is not known; known: {', '.join(ENTRY_POINTS)}") from None
