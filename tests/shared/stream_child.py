"""The child of a driver's process as far as a stream's driver needs it, and what it told."""

from groundstation.bus.memory_bus import MemoryBus


class StreamChild:
    """`told`: its readiness, losses and events, in words."""

    stop_requested, supervisor_alive, supervisor_fresh, spoken_for_ns = False, True, True, 0

    def __init__(self, bus: MemoryBus, name: str, section: str = "") -> None:
        self.bus, self.name, self.section = bus, name, section
        self.told: list[str] = []

    def ready(self, detail: str = "") -> None:
        self.told.append("READY")

    def degrade(self, detail: str, works: bool = True) -> None:
        self.told.append(f"DEGRADED {detail}")

    def event(self, severity: str, text: str, remedy: str = "", entity: str | None = None) -> None:
        self.told.append(f"{text}; {remedy}")

    def beat(self) -> None: ...
    def tick_status(self, ticks: int = 0, overruns: int = 0, overflowed: int = 0) -> None: ...
