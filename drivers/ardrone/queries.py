"""Queries to the drone over TCP: version.txt by FTP, and the configuration dump of the control port."""

import ftplib
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from drivers.ardrone.dump import END
from groundstation.adapters import connected, split_zone
from groundstation.errors import DriverError

_LONGEST_VERSION = 64
_LONGEST_DUMP = 65_536
_FTP_S = 0.7
_CONNECT_S = 1.0
_DUMP_S = 2.0


class _FtpThroughAdapter(ftplib.FTP):
    """FTP with connections through one network adapter: the library itself uses any."""

    def __init__(self, timeout_s: float, interface: str) -> None:
        super().__init__(timeout=timeout_s)
        self._timeout_s, self._interface = timeout_s, interface

    def open(self, address: str, port: int) -> None:
        """Connect and read the greeting."""
        self.host, self.port, self.af = address, port, socket.AF_INET
        self.sock = connected((address, port), self._timeout_s, self._interface)
        self.file = self.sock.makefile("r", encoding=self.encoding)
        self.welcome = self.getresp()

    def ntransfercmd(self, cmd: str, rest: int | str | None = None) -> tuple[socket.socket, int | None]:
        """Open the passive connection of a transfer; restarting in the middle is not supported."""
        stream = connected(self.makepasv(), self._timeout_s, self._interface)
        try:
            answer = self.sendcmd(cmd)
            if not answer.startswith("1"):
                raise ftplib.error_reply(answer)
        except BaseException:
            stream.close()
            raise
        return stream, None


def read_version(address: str, port: int, timeout_s: float = _FTP_S) -> str:
    """Return version.txt of the drone, or "" if unavailable; timeout_s: of each step.

    address: also ADDRESS%ADAPTER.

    WIRE (docs/reference/ardrone.md 1): FTP on port 5551, anonymous, passive.
    """
    parts: list[bytes] = []

    def take(part: bytes) -> None:
        parts.append(part)
        if sum(map(len, parts)) > _LONGEST_VERSION:
            raise EOFError

    host, interface = split_zone(address)
    with (
        suppress(OSError, EOFError, ValueError, ftplib.Error, DriverError),
        _FtpThroughAdapter(timeout_s, interface) as ftp,
    ):
        ftp.open(host, port)
        ftp.login()
        ftp.retrbinary("RETR version.txt", take)
    return b"".join(parts)[:_LONGEST_VERSION].decode("latin-1").strip()


def read_dump(address: str, port: int, listening: Callable[[], None]) -> bytes:
    """Return the next configuration dump, without its NUL, or b"" if none comes; `listening` is called once connected.

    address: also ADDRESS%ADAPTER.

    WIRE (docs/reference/ardrone.md 5.2): the client connects first, then asks by CTRL 4; a NUL ends the text.
    """
    text = bytearray()
    host, interface = split_zone(address)
    try:
        with connected((host, port), _CONNECT_S, interface) as stream:
            listening()
            deadline_s = time.monotonic() + _DUMP_S
            while END not in text and len(text) < _LONGEST_DUMP:
                stream.settimeout(max(0.001, deadline_s - time.monotonic()))
                part = stream.recv(8192)
                if not part:
                    return b""
                text += part
    except (OSError, DriverError):
        return b""
    return bytes(text.partition(END)[0])


class TcpInquirer:
    """Makes one query at a time in a thread of its own; the answer to an abandoned query is dropped.

    address: also ADDRESS%ADAPTER.
    """

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
