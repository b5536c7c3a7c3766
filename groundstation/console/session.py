"""Executes viewers' messages: the one place where pages' messages become commands."""

import hmac
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from groundstation.bus import clock
from groundstation.bus.api import Bus
from groundstation.bus.messages import Command, SimCommand
from groundstation.bus.roles import Role
from groundstation.bus.topics import SIM_COMMAND
from groundstation.console.commands import CommandDesk, Given
from groundstation.console.devices import DeviceRole
from groundstation.console.operator_lock import OperatorLock
from groundstation.console.player import Player
from groundstation.console.protocol import (
    CommandRequest,
    Drive,
    EndKept,
    FollowPath,
    FramesHandled,
    Hello,
    PageMessage,
    Place,
    Play,
    Playing,
    Release,
    Seek,
    Speed,
    Steering,
    StepReplay,
    TakeOver,
    Watch,
)
from groundstation.console.viewer import PageConnection
from groundstation.time_units import NS_PER_MS


def encoded(kind: str, **content: Any) -> str:
    """Return a message to a page."""
    return msgspec.json.encode({"type": kind, **content}).decode()


def _ref_of(message: PageMessage) -> str:
    return message.ref if isinstance(message, CommandRequest) else ""


def _may(role: DeviceRole, message: PageMessage) -> bool:
    """Return whether a device of a role may send a message; frames, hello and cameras are permitted to all."""
    stops = isinstance(message, CommandRequest) and message.verb.stops
    return role is DeviceRole.COMMAND or (role is DeviceRole.STOP and stops)


class Sessions:
    """All viewers, including the operator, and the rights of their pages.

    run: the identity of the run, which each order must name; simulated_targets: the bodies that pages may steer, none
    outside of simulation; pictures: the newest frame of each camera; player: the replay, if this is one: then nothing
    can be commanded.
    """

    def __init__(
        self,
        bus: Bus,
        desk: CommandDesk,
        token: str,
        run: str,
        simulated_targets: tuple[str, ...],
        pictures: Callable[[], Mapping[str, bytes]] = dict,
        player: Player | None = None,
    ) -> None:
        self._bus = bus
        self.desk = desk
        self._token = token
        self._run = run
        self._targets = simulated_targets
        self._newest_pictures = pictures
        self._player = player
        self.operator_lock = OperatorLock()
        self._starts_ns: dict[str, int] = {}
        self.viewers: dict[int, PageConnection] = {}
        self.refused: Counter[str] = Counter()

    def add(self, viewer: PageConnection) -> None:
        """Add a viewer."""
        self.viewers[viewer.number] = viewer

    def remove(self, viewer: PageConnection) -> None:
        """Remove a viewer."""
        self.viewers.pop(viewer.number, None)
        if viewer.client and not any(other.client == viewer.client for other in self.viewers.values()):
            self.operator_lock.left(viewer.client, clock.now_ns())

    def is_operators(self, hello: Hello) -> bool:
        """Return whether this comes from a page of the operator."""
        return self.operator_lock.client == hello.client and self._has_token(hello)

    def summary(self, now_ns: int) -> dict[str, Any]:
        """Return the viewers and the operator's name; never the id of the operator's page, which gives its rights."""
        return {
            "operator": self.operator_lock.name,
            "viewers": len(self.viewers),
            "lease": self.desk.lease_holder(now_ns),
        }

    def take(self, order: Command) -> None:
        """Pass the operator's place to another console at which a start was given; repetitions count once."""
        source, stamp_ns = order.header.source, order.header.stamp_ns
        foreign = source.split("_")[0] == Role.CONSOLE and source != self._bus.source
        if order.verb.stops or not foreign or self._player is not None or stamp_ns <= self._starts_ns.get(source, 0):
            return
        self._starts_ns[source] = stamp_ns
        if self.operator_lock.passed_to(source):
            self._tell(f"{order.verb} was given at {source}, another console: who did that is the operator now")

    def handle(self, viewer: PageConnection, message: PageMessage) -> None:
        """Execute a page's request; one without the right to it is answered with the reason."""
        match message:
            case FramesHandled(seq=seq, sent_ms=sent_ms):
                viewer.hear(sent_ms)
                viewer.saw(seq)
            case EndKept():
                viewer.keeps_end = True
            case Watch(cameras=cameras):
                self._watch(viewer, frozenset(cameras))
            case Hello():
                self._greet(viewer, message)
            case _ if not viewer.trusted:
                self._refuse(viewer, "untrusted", "this page may only look: reload it")
            case _ if not _may(viewer.role, message):
                text = f"this device may {viewer.role} only: invite it anew to let it do more"
                self._refuse(viewer, "role", text, _ref_of(message))
            case Play() | Speed() | Seek() | StepReplay():
                self._replay(viewer, message)
            case _ if self._player is not None:
                self._refuse(viewer, "replay", "this is a replay: nothing here can be commanded", _ref_of(message))
            case CommandRequest():
                self._order(viewer, message)
            case TakeOver():
                self._take_over(viewer)
            case Release():
                self.operator_lock.release(viewer.client)
            case _:
                self._steer(viewer, message)

    def _watch(self, viewer: PageConnection, cameras: frozenset[str]) -> None:
        fresh, viewer.watched = cameras - viewer.watched, cameras
        for camera, frame in self._newest_pictures().items():
            if camera in fresh:
                viewer.show(camera, frame)

    def _replay(self, viewer: PageConnection, message: Playing) -> None:
        if self._player is None:
            self._refuse(viewer, "no_replay", "this is no replay: time goes as it goes")
            return
        match message:
            case Play(playing=playing):
                self._player.play(playing)
            case Speed(factor=factor):
                self._player.set_speed(factor)
            case Seek(at_ms=at_ms):
                self._player.seek(round(at_ms * 1e6))
            case StepReplay(ticks=ticks):
                self._player.step(ticks)

    def _greet(self, viewer: PageConnection, hello: Hello) -> None:
        viewer.client = hello.client
        viewer.trusted = self._has_token(hello)
        if viewer.trusted and viewer.role is DeviceRole.COMMAND:
            self.operator_lock.arrived(viewer.client, viewer.name)
        elif viewer.trusted:
            self.operator_lock.release(viewer.client)  # it was invited anew, to do less
        else:
            self.refused["token"] += 1
        viewer.hear(hello.sent_ms)
        rights = {"trusted": viewer.trusted, "role": viewer.role}
        viewer.say(encoded("welcome", name=viewer.name, client=viewer.client, answer=viewer.take_answer(), **rights))

    def _has_token(self, hello: Hello) -> bool:
        return hmac.compare_digest(hello.token.encode(), self._token.encode())

    def _order(self, viewer: PageConnection, order: CommandRequest) -> None:
        if order.run != self._run:
            self._refuse(viewer, "other_run", f"{order.verb} was given for another run and was dropped", order.ref)
            return
        if not order.verb.stops and not self._operates(viewer, order.ref):
            return
        now_ns = clock.now_ns()
        # A page cannot know how long an order was under way, or waited here. What it does not know of the server's time
        # counts for a stop and against a start: a fresh stop must not be refused because news reach its page late.
        at_ms = order.at_ms + (order.unsure_ms if order.verb.stops else 0.0)
        age_ms = max(order.age_ms, now_ns / NS_PER_MS - at_ms)
        given = Given(viewer.name, age_ms, order.ref, order.anyway)
        problem = self.desk.give(order.verb, order.drones, given, now_ns)
        if problem:
            self._refuse(viewer, "order", problem, order.ref)

    def _operates(self, viewer: PageConnection, ref: str = "") -> bool:
        """Make a viewer the operator unless another one is, which it is told; returns whether it is."""
        if not self.operator_lock.may_start(viewer.client):
            self._refuse(viewer, "not_operator", f"{self.operator_lock.name} is the operator: take over first", ref)
            return False
        self.operator_lock.take(viewer.client, viewer.name)
        return True

    def _take_over(self, viewer: PageConnection) -> None:
        replaced = self.operator_lock.take(viewer.client, viewer.name)
        text = f"{viewer.name} has taken over from {replaced}: TAKE OFF, TRACK, RESUME are its own. Any page may stop"
        if replaced:
            self._tell(text, viewer)

    def _tell(self, text: str, but: PageConnection | None = None) -> None:
        for viewer in self.viewers.values():
            if viewer is not but:
                viewer.say(encoded("notice", text=text, grave=False, ref=""))

    def _steer(self, viewer: PageConnection, message: Steering) -> None:
        if not self._targets:
            self._refuse(viewer, "not_simulated", "the target is real: it cannot be steered from here")
            return
        name = message.target or self._targets[0]
        if name not in self._targets:
            self._refuse(viewer, "unknown_target", f"there is no target {name}")
            return
        if not self._operates(viewer):
            return
        header = self._bus.header(name)
        match message:
            case Drive(speed_m_s=speed, turn_rad_s=turn):
                command = SimCommand(header=header, action="drive", speed_m_s=speed, turn_rate_rad_s=turn)
            case Place(x_m=x, y_m=y):
                command = SimCommand(header=header, action="place", position_m=(x, y, 0.0))
            case FollowPath():
                command = SimCommand(header=header, action="path")
        self._bus.publish(SIM_COMMAND, command)

    def _refuse(self, viewer: PageConnection, reason: str, text: str, ref: str = "") -> None:
        self.refused[reason] += 1
        viewer.say(encoded("notice", text=text, grave=True, ref=ref))
