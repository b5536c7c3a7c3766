"""The description of a server of a vehicle's own video, for kinds that have one."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class OwnVideo:
    """The server of a vehicle's own video; picklable.

    output: "module:class" of a `sim_bridge.render.outputs.Output`, made from the camera's RenderSpec and the connection
    by which changes of the emulator's `video_settings` arrive. options: its other arguments; repeats: lost
    parts are sent again, and arrive late (TCP). listens: it waits for clients at its port;
    else it sends to the client that asked the vehicle.
    """

    output: str
    options: Mapping[str, object] = field(default_factory=dict)
    repeats: bool = True
    listens: bool = True
