"""Feeds Rerun's viewer from the bus: its server runs as a child process, bound to loopback. Extra [rerun]."""

import subprocess
from importlib.util import find_spec
from pathlib import Path

import rerun as rr

from groundstation.bus import codec, keys
from groundstation.bus.api import Sample
from groundstation.engineering_views.rerun_file import APPLICATION
from groundstation.engineering_views.rerun_scene import RerunScene, blueprint
from groundstation.engineering_views.watch import LiveView
from groundstation.errors import GroundStationError, MessageError
from groundstation.field.resolved import ResolvedField
from groundstation.recording.file_topics import is_picture
from groundstation.recording.timeline import Timeline

HOST = "127.0.0.1"
# Without limits server and viewer keep all data.
_MEMORY = "512MB"
_LAST_WORDS_S = 2.0


class RerunServer:
    """The viewer's own server. The SDK could serve too, but only on all interfaces."""

    def __init__(self, port: int, web_port: int) -> None:
        found = find_spec("rerun_cli")
        assert found is not None and found.origin is not None
        # The `rerun` script is a wrapper: ending it would leave the real program running.
        program = Path(found.origin).with_name("rerun")
        places = ["--bind", HOST, "--port", str(port), "--web-viewer-port", str(web_port)]
        self._process = subprocess.Popen(
            [str(program), "--serve-web", *places, "--server-memory-limit", _MEMORY, "--memory-limit", _MEMORY],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        self.url = f"rerun+http://{HOST}:{port}/proxy"
        self.page = f"http://{HOST}:{web_port}/?url=rerun%2Bhttp%3A%2F%2F{HOST}%3A{port}%2Fproxy"

    @property
    def alive(self) -> bool:
        """Return whether it runs."""
        return self._process.poll() is None

    def close(self) -> None:
        """End the server."""
        self._process.terminate()
        try:
            self._process.wait(_LAST_WORDS_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class RerunView(LiveView):
    """Shows the bus's messages, on a server or in a file."""

    def __init__(
        self,
        name: str,
        field: ResolvedField | None,
        timeline: Timeline,
        start_ns: int,
        server: RerunServer | None,
        file: Path | None,
    ) -> None:
        self._server = server
        self._timeline = timeline
        self._stream = rr.RecordingStream(APPLICATION, recording_id=name)
        if server is not None:
            self._stream.connect_grpc(server.url, default_blueprint=blueprint(field))
        elif file is not None:
            self._stream.save(file, default_blueprint=blueprint(field))
        self._scene = RerunScene(self._stream, field, start_ns)

    @property
    def alive(self) -> bool:
        """Return whether its server or file can still be written to."""
        return self._server is None or self._server.alive

    def take(self, sample: Sample, now_ns: int) -> None:
        """Show a sample that arrived at a boot-clock time; samples that cannot be decoded are ignored."""
        try:
            key = keys.parse(sample.key)
            if is_picture(key.topic):
                header = codec.decode_header(key, sample.attachment)
                shown_ns, _ = self._timeline.times(header.stamp_ns, header.clock, now_ns)
                self._scene.take_picture(shown_ns, key.entity, key.topic, sample.payload)
            elif key.topic.type is not None:
                message = codec.decode(key, sample.payload)
                shown_ns, _ = self._timeline.times(message.header.stamp_ns, message.header.clock, now_ns)
                self._scene.take(shown_ns, message)
        except MessageError:
            return

    def close(self) -> None:
        """Send remaining data, without waiting for a viewer that does not answer."""
        try:
            self._stream.flush(timeout_sec=_LAST_WORDS_S)
        except (RuntimeError, ValueError) as error:
            raise GroundStationError(f"the viewer did not take everything: {error}") from error
        finally:
            self._stream.disconnect()
            if self._server is not None:
                self._server.close()
