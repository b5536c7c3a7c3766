"""Scripted drone on loopback, with bytes assembled by hand: UDP, and TCP where a test needs it."""

import itertools
import os
import re
import socket
import struct
import threading
from contextlib import suppress

FLY, COMMAND_BIT, BOOTSTRAP, EMERGENCY = 1 << 0, 1 << 6, 1 << 11, 1 << 31
_numbers = itertools.count(1)


def checked(body: bytes) -> bytes:
    return body + struct.pack("<HHI", 0xFFFF, 8, sum(body))


class ScriptedTcp:
    """FTP with a version.txt on 5551 and the control port 5559, each for one client at a time."""

    def __init__(self, address: str, version: str) -> None:
        self.address, self.version = address, version
        self.clients: list[socket.socket] = []
        self.ftp, self.control = (socket.create_server((address, port)) for port in (5551, 5559))
        for serve in (self._serve_ftp, self._serve_control):
            threading.Thread(target=serve, daemon=True).start()

    def close(self) -> None:
        for listening in (self.ftp, self.control, *self.clients):
            with suppress(OSError):
                listening.shutdown(socket.SHUT_RDWR)
            listening.close()

    def _serve_ftp(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self.ftp.accept()
                with client:
                    self._speak_ftp(client)

    def _speak_ftp(self, client: socket.socket) -> None:
        data = socket.create_server((self.address, 0))
        high, low = divmod(data.getsockname()[1], 256)
        answers = {
            "USER": "331 go on",
            "PASS": "230 in",
            "TYPE": "200 binary",
            "PASV": f"227 Entering Passive Mode ({self.address.replace('.', ',')},{high},{low})",
            "RETR": "150 here it comes",
            "QUIT": "221 bye",
        }
        client.sendall(b"220 ready\r\n")
        with data, client.makefile("r", encoding="ascii", newline="\r\n") as lines:
            for line in lines:
                client.sendall((answers.get(line[:4], "502 what?") + "\r\n").encode())
                if line.startswith("RETR version.txt"):
                    stream, _ = data.accept()
                    with stream:
                        stream.sendall(f"{self.version}\n".encode())
                    client.sendall(b"226 done\r\n")

    def _serve_control(self) -> None:
        with suppress(OSError):
            while True:
                self.clients.append(self.control.accept()[0])

    def dump(self, config: dict[str, str]) -> None:
        values = {
            "general:num_version_soft": self.version,
            "general:drone_serial": "PS721000AB2L01234",
            "network:wifi_mode": "0",
            "network:owner_mac": "00:00:00:00:00:00",
            "control:accs_gains": "{ 1.0000000e+00 0.0000000e+00\n0.0000000e+00 }",
        } | config
        text = "".join(f"{key} = {value}\n" for key, value in values.items()).encode() + b"\0"
        for client in self.clients:
            with suppress(OSError):
                client.sendall(text)


class ScriptedDrone:
    """Two sockets and a state: acknowledges CONFIG, takes off and lands at once, records every command line.

    Of all senders it obeys the number 1, and those above the last one that it obeyed. loses: how many datagrams it
    loses next.
    """

    def __init__(self) -> None:
        pid = os.getpid()
        self.address = f"127.{10 + pid % 90}.{pid // 90 % 250}.{next(_numbers)}"
        self.navdata, self.at = self._open(5554), self._open(5556)
        self.client: tuple[str, int] | None = None
        self.requests = 0
        self.sequence = 0
        self.state = BOOTSTRAP
        self.major = 2
        self.psi = self.force_mg = 0.0
        self.theta = 1000.0
        self.select = False
        self.number = self.moved_by = self.loses = 0
        self.lie = ""  # frozen: every value repeats; stuck: the velocity does
        self.lines: list[tuple[str, int, str]] = []
        self.heeded: list[tuple[str, str]] = []
        self.config: dict[str, str] = {}
        self.deaf_to: set[str] = set()
        self.tcp: ScriptedTcp | None = None

    def _open(self, port: int) -> socket.socket:
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        udp.bind((self.address, port))
        udp.setblocking(False)
        return udp

    def close(self) -> None:
        self.navdata.close()
        self.at.close()
        if self.tcp is not None:
            self.tcp.close()

    def packet(self) -> bytes:
        self.sequence += 1
        body = struct.pack("<IIII", 0x55667788, self.state, self.sequence, 0)
        if self.state & BOOTSTRAP:
            return checked(body)
        # In flight no value repeats exactly; float32 resolves no smaller difference.
        stir = 0.0 if self.lie == "frozen" else 6e-5 * (self.sequence % 2)
        moved = 0.0 if self.lie else stir
        altitude = 800 if self.state & FLY else 0
        demo = struct.pack(
            "<HHIIfffifffI",
            *(
                0,
                148,
                self.major << 16,
                80,
                self.theta + 2 * stir,
                500.0,
                self.psi,
                altitude,
                300.0 + moved,
                200.0 + moved,
            ),
            *(0, 0),
        )
        phys = struct.pack("<HHfH6fIII", 3, 46, 40.0, 0, self.force_mg, 0.0, -1000.0 - 2 * stir, 1.0, 2.0, 3.0, 0, 0, 0)
        references = struct.pack("<HH", 6, 88).ljust(84, b"\0") + struct.pack("<i", self.moved_by)
        return checked(body + demo.ljust(148, b"\0") + phys + references)

    def turn(self) -> None:
        """Read all datagrams, and stream one packet."""
        for _, source in self._waiting(self.navdata):
            self.client, self.requests = source, self.requests + 1
        for datagram, _ in self._waiting(self.at):
            assert len(datagram) <= 1000 and datagram.endswith(b"\r")
            if self.loses > 0:
                self.loses -= 1
                continue
            for line in datagram.decode("ascii").split("\r")[:-1]:
                match = re.fullmatch(r"AT\*(\w+)=(\d+),?(.*)", line)
                assert match, line
                self.obey(match[1], int(match[2]), match[3])
        if self.client is not None:
            self.navdata.sendto(self.packet(), self.client)

    @staticmethod
    def _waiting(udp: socket.socket) -> list[tuple[bytes, tuple[str, int]]]:
        came = []
        while True:
            try:
                came.append(udp.recvfrom(2048))
            except BlockingIOError:
                return came

    def obey(self, name: str, sequence: int, arguments: str) -> None:
        self.lines.append((name, sequence, arguments))
        if sequence != 1 and sequence <= self.number:
            return
        self.number = sequence
        self.heeded.append((name, arguments))
        if name == "PCMD":
            self.moved_by = sequence
        if name == "CONFIG" and not self.state & COMMAND_BIT:
            key, value = arguments.replace('"', "").split(",")
            if key not in self.deaf_to:
                self.config[key] = value
            self.state = (self.state | COMMAND_BIT) & ~BOOTSTRAP
        if name == "CTRL" and arguments.startswith("5"):
            self.state &= ~COMMAND_BIT
        if name == "CTRL" and arguments == "4,0" and self.tcp is not None:
            self.tcp.dump(self.config)
            self.state |= COMMAND_BIT
        if name == "REF":
            bits = int(arguments)
            if bits & 0x100 and not self.select:
                self.state ^= EMERGENCY
                self.state &= ~FLY
            elif not self.state & EMERGENCY:
                self.state = self.state | FLY if bits & 0x200 else self.state & ~FLY
            self.select = bool(bits & 0x100)
            self.major = 4 if self.state & FLY else 2

    def said(self, name: str) -> list[str]:
        return [arguments for who, _, arguments in self.lines if who == name]
