"""The video of a vehicle's own, where its kind has one: what draws and serves it."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class OwnVideo:
    """What serves the pictures of a vehicle's own camera; picklable.

    output: "module:class" of a `sim_bridge.render.outputs.Output`, made from the camera's RenderSpec and the connection
    by which the emulator's `video_settings` come, as they change. options: what it is told besides; repeats: what is
    lost of it is sent again, and comes late (TCP). listens: it waits for clients at its port;
    else it sends to who has asked the vehicle.
    """

    output: str
    options: Mapping[str, object] = field(default_factory=dict)
    repeats: bool = True
    listens: bool = True
