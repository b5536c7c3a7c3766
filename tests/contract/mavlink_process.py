"""Stand-in for `Child`, without a process."""


class FakeProcess:
    """Records its calls; `texts` are those of its events."""

    def __init__(self, bus):
        self.name, self.bus, self.section = bus.source, bus, "{}"
        self.stop_requested, self.supervisor_alive, self.supervisor_fresh = False, True, True
        self.spoken_for_ns = 0
        self.events = []

    @property
    def texts(self):
        return [text for _, text in self.events]

    def beat(self):
        pass

    def ready(self, detail=""):
        pass

    def degrade(self, detail):
        pass

    def leave(self, number):
        self.left = number

    def note_addresses(self, addresses):
        self.addresses = tuple(addresses)

    def tick_status(self, ticks=0, overruns=0, overflowed=0):
        pass

    def sleep_until(self, deadline_ns):
        return True

    def wake(self):
        pass

    def event(self, severity, text, remedy="", entity=None):
        self.events.append((severity, text))
