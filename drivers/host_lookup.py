"""The addresses of a host that is given by its name: looked up in a thread, since a lookup can take many seconds."""

import ipaddress
import socket
import threading
from contextlib import suppress


class HostLookup:
    """A host and its IPv4 addresses.

    found: its addresses, () until they are known; failed: why its name has none, or "".
    """

    def __init__(self, host: str) -> None:
        self.found: tuple[str, ...] = ()
        self.failed = ""
        self._host = host
        self._thread: threading.Thread | None = None
        with suppress(ValueError):
            self.found = (str(ipaddress.IPv4Address(host)),)
        self._is_name = not self.found

    def look_up(self) -> None:
        """Look a name up, unless that is going on; returns at once, and keeps what was found until then."""
        if self._is_name and (self._thread is None or not self._thread.is_alive()):
            self._thread = threading.Thread(target=self._find, name="host lookup", daemon=True)
            self._thread.start()

    def _find(self) -> None:
        try:
            entries = socket.getaddrinfo(self._host, None, socket.AF_INET, socket.SOCK_DGRAM)
        except (OSError, UnicodeError) as error:  # UnicodeError: no name at all, such as one with an empty part
            if not self.found:
                why = error.strerror if isinstance(error, OSError) and error.strerror else error
                self.failed = f"no IPv4 address is known for the name {self._host}: {why}"
            return
        self.found, self.failed = tuple(dict.fromkeys(str(entry[4][0]) for entry in entries)), ""
