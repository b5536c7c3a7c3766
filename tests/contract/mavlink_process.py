"""Stand-in for `Child`, without a process."""


class FakeProcess:
    """Records its calls; `texts` are those of its events, `states` those that it was told, with their details."""

    def __init__(self, bus):
        self.name, self.bus, self.section = bus.source, bus, "{}"
        self.stop_requested, self.supervisor_alive, self.supervisor_fresh = False, True, True
        self.spoken_for_ns = 0
        self.events, self.states = [], []

    @property
    def texts(self):
        return [text for _, text in self.events]

    def beat(self):
        pass

    def ready(self, detail=""):
        self.states.append(f"READY {detail}")

    def degrade(self, detail, works=True):
        self.states.append(f"DEGRADED {detail}")

    def finish(self):
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
