"""Questions to the drone over TCP: version.txt by FTP, and the configuration dump of the control port."""

import ftplib
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from drivers.ardrone.dump import END

_LONGEST_VERSION = 64
_LONGEST_DUMP = 65_536
_FTP_S = 0.7
_CONNECT_S = 1.0
_DUMP_S = 2.0


def read_version(address: str, port: int, timeout_s: float = _FTP_S) -> str:
    """Return version.txt of the drone, "" when it cannot be had; timeout_s is of each step.

    WIRE (docs/reference/ardrone.md 1): FTP on port 5551, anonymous, passive.
    """
    parts: list[bytes] = []

    def take(part: bytes) -> None:
        parts.append(part)
        if sum(map(len, parts)) > _LONGEST_VERSION:
            raise EOFError

    with suppress(OSError, EOFError, ValueError, ftplib.Error), ftplib.FTP(timeout=timeout_s) as ftp:
        ftp.connect(address, port)
        ftp.login()
        ftp.retrbinary("RETR version.txt", take)
    return b"".join(parts)[:_LONGEST_VERSION].decode("latin-1").strip()


def read_dump(
    address: str, port: int, connected: Callable[[], None], wait_s: float = _DUMP_S, connect_s: float = _CONNECT_S
) -> bytes:
    """Return the next configuration dump, without its NUL, b"" when none comes; `connected` is called in between.

    WIRE (docs/reference/ardrone.md 5.2): the client connects first, then asks by CTRL 4; a NUL ends the text.
    """
    text = bytearray()
    try:
        with socket.create_connection((address, port), timeout=connect_s) as stream:
            connected()
            deadline_s = time.monotonic() + wait_s
            while END not in text and len(text) < _LONGEST_DUMP:
                stream.settimeout(max(0.001, deadline_s - time.monotonic()))
                part = stream.recv(8192)
                if not part:
                    return b""
                text += part
    except OSError:
        return b""
    return bytes(text.partition(END)[0])


class TcpInquirer:
    """Asks one thing at a time in a thread of its own; an answer to a question given up is dropped."""

    def __init__(self, address: str, ftp_port: int, control_port: int) -> None:
        self._address, self._ftp_port, self._control_port = address, ftp_port, control_port
        self._question = 0
        self.version: str | None = None
        self.dump: bytes | None = None
        self.listening = False

    def ask_version(self) -> None:
        """Begin to read version.txt."""
        self.version = None
        self._start(self._fetch_version)

    def ask_dump(self) -> None:
        """Connect to the control port and wait for a dump."""
        self.dump, self.listening = None, False
        self._start(self._fetch_dump)

    def _start(self, target: Callable[[int], None]) -> None:
        self._question += 1
        threading.Thread(target=target, args=(self._question,), name="inquiry", daemon=True).start()

    def _fetch_version(self, question: int) -> None:
        text = read_version(self._address, self._ftp_port)
        if question == self._question:
            self.version = text

    def _fetch_dump(self, question: int) -> None:
        text = read_dump(self._address, self._control_port, lambda: self._listen(question))
        if question == self._question:
            self.dump, self.listening = text, False

    def _listen(self, question: int) -> None:
        self.listening = question == self._question
