"""The part of FTP that clients of an AR.Drone use: anonymous, passive, reading `version.txt`.

WIRE: port 5551 serves `version.txt` ("2.3.3"), by which the SDK distinguishes the generations; port 21 the data
partition, of which PS-Drone only checks that it is open (docs/reference/ardrone.md 1). A server of a library would need
a thread and write access of its own; this one shares the emulator's loop and writes nothing.
"""

from collections.abc import Callable, Mapping

from groundstation.errors import GroundStationError
from sim_bridge.devices.ardrone_tcp import Connection, Selector, TcpPort

_LONGEST_LINE = 512


class FtpServer:
    """A folder of small files on one port."""

    def __init__(self, name: str, address: str, port: int, selector: Selector, files: Mapping[str, bytes]) -> None:
        self._port = TcpPort(name, address, port, selector, lambda each: _Dialogue(each, address, selector, files))

    def close(self) -> None:
        """Close port and connections; idempotent."""
        self._port.close()


class _Dialogue:
    """One control connection, and the data connection that it announced."""

    def __init__(self, control: Connection, address: str, selector: Selector, files: Mapping[str, bytes]) -> None:
        self._control, self._address, self._selector, self._files = control, address, selector, files
        self._line = bytearray()
        self._passive: TcpPort | None = None
        self._data: Connection | None = None
        self._outgoing: bytes | None = None
        self._replies: dict[str, Callable[[str], str]] = {
            # WIRE (Parrot's SDK): asked for a password, it repeats its USER for ever.
            "USER": lambda _: "230 logged in",
            "PASS": lambda _: "230 logged in",
            "SYST": lambda _: "215 UNIX Type: L8",
            "FEAT": lambda _: "211 no features",
            "TYPE": lambda _: "200 type set",
            "MODE": lambda _: "200 mode set",
            "STRU": lambda _: "200 structure set",
            "NOOP": lambda _: "200 ok",
            "PWD": lambda _: '257 "/" is the folder',
            "CWD": lambda path: "250 ok" if path.strip("/.") == "" else "550 no such folder",
            "PASV": self._listen,
            "EPSV": self._listen_extended,
            "SIZE": self._size,
            "RETR": self._retrieve,
            "NLST": self._names,
            "LIST": self._listing,
        }
        control.send(b"220 ready\r\n")

    def take(self, data: bytes) -> None:
        """Take bytes of commands."""
        self._line += data
        while b"\n" in self._line and self._control.open:
            line, _, rest = bytes(self._line).partition(b"\n")
            self._line = bytearray(rest)
            self._answer(line.decode("latin-1").strip())
        if len(self._line) > _LONGEST_LINE:
            self._control.close()

    def end(self) -> None:
        """Close the data connection with the control connection."""
        self._close_data()

    def _answer(self, line: str) -> None:
        verb, _, argument = line.partition(" ")
        if verb.upper() == "QUIT":
            self._control.send(b"221 goodbye\r\n")
            self._control.close_when_sent()
            return
        reply = self._replies.get(verb.upper())
        text = "502 not here" if reply is None else reply(argument)
        self._control.send(f"{text}\r\n".encode("latin-1"))
        self._transfer()

    def _listen(self, _argument: str) -> str:
        port = self._open_data()
        if port is None:
            return "425 no port for data"
        return f"227 entering passive mode ({self._address.replace('.', ',')},{port >> 8},{port & 0xFF})"

    def _listen_extended(self, _argument: str) -> str:
        port = self._open_data()
        return "425 no port for data" if port is None else f"229 entering extended passive mode (|||{port}|)"

    def _open_data(self) -> int | None:
        self._close_data()
        try:
            self._passive = TcpPort("data port", self._address, 0, self._selector, self._connected)
        except GroundStationError:
            return None
        return self._passive.address[1]

    def _connected(self, data: Connection) -> "_DataConversation":
        self._data = data
        self._transfer()
        return _DataConversation()

    def _size(self, path: str) -> str:
        content = self._files.get(path.strip("/"))
        return "550 no such file" if content is None else f"213 {len(content)}"

    def _retrieve(self, path: str) -> str:
        return self._offer(self._files.get(path.strip("/")))

    def _names(self, _path: str) -> str:
        return self._offer("".join(f"{name}\r\n" for name in self._files).encode())

    def _listing(self, _path: str) -> str:
        rows = (f"-r--r--r-- 1 0 0 {len(data):8d} Jan  1 2013 {name}\r\n" for name, data in self._files.items())
        return self._offer("".join(rows).encode())

    def _offer(self, content: bytes | None) -> str:
        if content is None:
            return "550 no such file"
        if self._passive is None:
            return "425 PASV first"
        self._outgoing = content
        return "150 here it comes"

    def _transfer(self) -> None:
        """Send the requested file once the client has connected for it."""
        if self._outgoing is None or self._data is None:
            return
        content, self._outgoing = self._outgoing, None
        self._data.send(content)
        self._data.close_when_sent()
        self._data = None
        self._control.send(b"226 done\r\n")
        self._close_listener()

    def _close_data(self) -> None:
        self._outgoing = self._data = None
        if self._passive is not None:
            self._passive.close()
            self._passive = None

    def _close_listener(self) -> None:
        # Only the listening end: a transfer in progress closes by itself.
        if self._passive is not None:
            self._passive.stop_listening()
            self._passive = None


class _DataConversation:
    """Nothing is ever read from a data connection."""

    def take(self, data: bytes) -> None:
        """Ignore an upload."""

    def end(self) -> None:
        """Nothing belongs to it."""
