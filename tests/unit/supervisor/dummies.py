"""Dummy child processes that behave as their names say."""

import json
import os
import signal
import socket
import time


def turn(child):
    child.beat()
    child.tick_status()
    child.sleep_until(time.monotonic_ns() + 20_000_000)


def obedient(child):
    settings = json.loads(child.section)
    time.sleep(settings.get("slow_s", 0))
    if settings.get("hoarse_s"):
        child.degrade("no picture")
        time.sleep(settings["hoarse_s"])
    print("epoch", settings.get("epoch"), flush=True)
    child.ready("fine")
    while not child.stop_requested and child.supervisor_alive:
        turn(child)
    if not child.supervisor_alive:
        print("orphan leaves", flush=True)
    child.finish()
    return 0


def returns_when_told(child):
    """Leave a stopped or orphaned run without a word on its drone."""
    child.ready()
    while not child.stop_requested and child.supervisor_alive:
        turn(child)
    return 0


def deaf(child):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    child.ready()
    while True:
        turn(child)


def crashing(child):
    raise RuntimeError("no luck")


def never_ready(child):
    child.starting("waiting for a drone")
    while not child.stop_requested and child.supervisor_alive:
        turn(child)
    return 0


def killed_when_ready(child):
    child.ready()
    os.kill(os.getpid(), signal.SIGKILL)


def flying(child):
    """Send to a drone 30 times a second, whatever happens to its parents."""
    drone = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    child.ready()
    while not child.stop_requested:
        child.beat()
        drone.sendto(b"fly", ("127.0.0.1", json.loads(child.section)["port"]))
        child.sleep_until(time.monotonic_ns() + 33_000_000)
    child.finish()
    return 0


def gives_up(child):
    """Return from a flight without an exception, as for a lost connection."""
    child.ready()
    time.sleep(0.3)
    return 0


def ends_its_work(child):
    child.ready()
    turn(child)
    child.finish()
    return 0
