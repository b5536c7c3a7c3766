"""The sticks of a Tello that lands: the last ones stay in force."""

import math
import socket
from contextlib import closing
from pkgutil import resolve_name

from drivers.tello.wire.text import rc
from drivers.watchdog_types import Action
from groundstation.vehicles import kind_named
from sim_bridge.conformance.subject import subject_of


def travelled(rig, *words: bytes) -> float:
    """Return how far one that flies at 0.6 m/s gets from an order until it stands [m]."""
    rig.say(b"command")
    rig.say(b"takeoff", 4.0)
    rig.say(rc(0, 60, 0, 0), 2.0)
    x, y = rig.body.airframe.x, rig.body.airframe.y
    for said in words:
        rig.say(said)
    rig.turn(5.0)
    assert not rig.body.motors_on
    return math.hypot(rig.body.airframe.x - x, rig.body.airframe.y - y)


def test_land_alone_lets_it_fly_on_with_its_last_sticks(rig):
    assert travelled(rig, b"land") > 1.2


def test_the_driver_centres_the_sticks_of_one_that_lands(rig, flight):
    words = [flight.told(Action.LAND)[0], flight.heard.recv(64)]
    assert travelled(rig, *words) < 0.6


def test_the_fail_safe_lands_one_that_flies_away_with_centred_sticks(rig):
    stop = kind_named("tello").stop([subject_of("tello").order()])
    with (
        closing(resolve_name(stop.transport)(stop.way, 2)) as transport,
        closing(socket.socket(type=socket.SOCK_DGRAM)) as heard,
    ):
        heard.bind(("127.64.79.11", 0))
        heard.settimeout(1.0)
        transport.send(stop.land, [heard.getsockname()])
        words = [heard.recv(64), heard.recv(64)]
        transport.send(stop.hover, [heard.getsockname()])
        assert heard.recv(64) == b"rc 0 0 0 0"
    assert words == [b"rc 0 0 0 0", b"land"] and travelled(rig, *words) < 0.6


def test_a_deaf_one_flies_as_far_as_the_safety_page_says(rig):
    """It hears nothing any more: its last sticks stay in force for 15 s, and while it lands."""
    rig.say(b"command")
    rig.say(b"takeoff", 4.0)
    x, y = rig.body.airframe.x, rig.body.airframe.y
    rig.say(rc(0, 60, 0, 0))
    rig.vehicle.deaf = True
    for _ in range(20):
        rig.say(b"rc 0 0 0 0", 0.5)
        rig.say(b"emergency", 0.5)
    assert not rig.body.motors_on
    assert 9.0 < math.hypot(rig.body.airframe.x - x, rig.body.airframe.y - y) < 11.5
