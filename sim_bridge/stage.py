"""The parts that all loops of emulated devices share: world, devices at their sockets, truth, pictures."""

import select
from collections.abc import Callable, Iterable

from sim_bridge.cameras import Cameras
from sim_bridge.render.spec import RenderSpec
from sim_bridge.truth import TruthBoard, remove_stale_boards
from sim_bridge.world.emulation import Emulator, video_settings_of
from sim_bridge.world.obstacles import box_names
from sim_bridge.world.world import World


class Stage:
    """A world and its devices; `close` releases everything, in any state."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.emulators: dict[str, Emulator] = {}
        self.cameras: Cameras | None = None
        self._board: TruthBoard | None = None
        self._poll = select.poll()
        self._readers: dict[int, Callable[[], None]] = {}

    def add(self, name: str, emulator: Emulator, descriptor: int) -> None:
        """Add a device, and read from it whenever its descriptor is readable."""
        self.emulators[name] = emulator
        self._poll.register(descriptor, select.POLLIN)
        self._readers[descriptor] = emulator.receive

    def share_truth(self, name: str) -> None:
        """Let render processes read the states of all bodies and obstacles under that name."""
        remove_stale_boards()
        self._board = TruthBoard.create(name, (*self.world.bodies, *box_names(len(self.world.obstacles))))

    def open_cameras(self, specs: Iterable[RenderSpec], should_stop: Callable[[], bool]) -> None:
        """Start the render processes; returns when every stream is served. Raises GroundStationError."""
        self.cameras = Cameras(specs)
        self.cameras.wait_until_serving(should_stop)

    def tick(self, stamp_ns: int) -> None:
        """Advance by 5 ms; stamp_ns: boot-clock time of the new states."""
        for descriptor, _ in self._poll.poll(0):
            self._readers[descriptor]()
        self.world.step()
        for emulator in self.emulators.values():
            emulator.send()
        if self._board is not None:
            boxes = (box.row() for box in self.world.obstacles)
            self._board.write(stamp_ns, (*self.world.rows(), *boxes))

    def tell_cameras(self) -> None:
        """Pass the drones' video configurations to the render processes."""
        if self.cameras is None:
            return
        for name in self.cameras.configurable:
            if (settings := video_settings_of(self.emulators[name])) is not None:
                self.cameras.set_mode(name, settings)

    def close(self) -> None:
        """Stop the cameras, close the ports, remove the truth; idempotent."""
        if self.cameras is not None:
            self.cameras.stop()
            self.cameras = None
        for emulator in self.emulators.values():
            emulator.close()
        self.emulators.clear()
        if self._board is not None:
            self._board.close()
            self._board = None
