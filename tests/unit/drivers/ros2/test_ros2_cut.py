"""The order that stops the motors: some nodes switch by it, so that a second one undoes the first."""

from dataclasses import replace
from typing import Any

import pytest
from ros2_node import MS, STANDING, FakeLink, Node

from drivers.ros2.names import Order
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision


class Switching:
    """A node whose `reset` switches its emergency over, as that of ardrone_autonomy does; it falls without motors."""

    def __init__(self, node: Node, height_m: float, obeys_from: int = 1) -> None:
        self.node, self.height_m, self.obeys_from = node, height_m, obeys_from
        self.emergency, self.fallen_m_s = False, 0.0
        link: Any = node.driver._link
        self.link: FakeLink = link

    def cut(self, seconds: float, order_ns: int = 1, speaks: bool = True) -> None:
        for _ in range(round(20 * seconds)):
            before = len(self.link.ordered)
            self.node.driver.apply(self.node.now_ns, WatchdogDecision(DriverMode.CUT, Action.CUT, entered_ns=order_ns))
            if len(self.link.ordered) > before and len(self.link.ordered) >= self.obeys_from:
                self.emergency = not self.emergency
            self.fallen_m_s = self.fallen_m_s + 9.81 * 0.05 if self.emergency and self.height_m else 0.0
            self.height_m = max(0.0, self.height_m - 0.05 * self.fallen_m_s)
            if speaks:
                falls = replace(STANDING, position=(0.0, 0.0, self.height_m), velocity=(0.0, 0.0, -self.fallen_m_s))
                self.node.say(falls)
            else:
                self.node.now_ns += 50 * MS


def aloft(node: Node, height_m: float) -> Switching:
    for _ in range(5):
        node.say(replace(STANDING, position=(0.0, 0.0, height_m)))
    return Switching(node, height_m)


@pytest.mark.parametrize("height_m", [0.0, 0.5, 1.5, 3.0, 4.0])
def test_a_cut_that_is_obeyed_is_sent_once(node: Node, height_m: float) -> None:
    vehicle_ = aloft(node, height_m)
    vehicle_.cut(10.0)
    assert vehicle_.link.ordered == [str(Order.CUT)] and vehicle_.emergency and vehicle_.height_m == 0.0


def test_one_that_was_lost_is_sent_again_before_the_watchdog_lands(node: Node) -> None:
    lost = aloft(node, 1.5)
    lost.obeys_from = 2
    lost.cut(1.9)
    assert lost.link.ordered == [str(Order.CUT)] * 2 and lost.emergency


def test_an_acknowledged_one_is_not_sent_again(node: Node) -> None:
    deaf = aloft(node, 1.5)
    deaf.obeys_from = 99
    deaf.link.accepted.add(Order.CUT)
    deaf.cut(5.0)
    assert deaf.link.ordered == [str(Order.CUT)]


def test_without_odometry_it_is_sent_once_and_that_is_said(node: Node) -> None:
    silent = aloft(node, 1.5)
    silent.cut(10.0, speaks=False)
    assert silent.link.ordered == [str(Order.CUT)]
    detail = node.driver.health(node.now_ns).detail
    assert detail.startswith("/drone_1/reset was sent once: without odometry nothing tells whether its motors stopped")


def test_a_double_click_is_one_order_and_a_later_one_another(node: Node) -> None:
    silent = aloft(node, 1.5)
    silent.cut(0.3, order_ns=1, speaks=False)
    silent.cut(0.5, order_ns=2, speaks=False)
    assert len(silent.link.ordered) == 1
    silent.cut(5.0, order_ns=3, speaks=False)
    assert len(silent.link.ordered) == 2, "the operator asked again"


def test_one_that_nobody_takes_is_sent_until_somebody_does(node: Node, monkeypatch: pytest.MonkeyPatch) -> None:
    alone = aloft(node, 1.5)
    monkeypatch.setattr(alone.link, "is_taken", lambda order: False)
    alone.obeys_from = 99
    alone.cut(2.0, speaks=False)
    assert len(alone.link.ordered) == 4
    monkeypatch.setattr(alone.link, "is_taken", lambda order: True)
    alone.cut(5.0, speaks=False)
    assert len(alone.link.ordered) == 5
