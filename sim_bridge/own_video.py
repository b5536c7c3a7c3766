"""Describes what draws and serves a vehicle's own video, if its kind has one."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class OwnVideo:
    """The server of a vehicle's own video; picklable.

    output: "module:class" of a `sim_bridge.render.outputs.Output`, made from the camera's RenderSpec and the connection
    by which the emulator's `video_settings` come, as they change. options: its other arguments; repeats: what is
    lost of it is sent again, and comes late (TCP). listens: it waits for clients at its port;
    else it sends to the client that asked the vehicle.
    """

    output: str
    options: Mapping[str, object] = field(default_factory=dict)
    repeats: bool = True
    listens: bool = True
