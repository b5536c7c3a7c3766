"""The password in a camera's address reaches its driver, and is never written, published or shown."""

import logging
from pathlib import Path

import msgspec
import pytest
from click.testing import CliRunner

from drivers.camera.settings import CameraDriverSettings
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.cli.config import config
from groundstation.errors import DriverError, SettingsError, without_password, without_passwords
from groundstation.flight.composition import process_table
from groundstation.process.log import DiscreetFormatter
from groundstation.recording.reader import attached_field
from groundstation.runtime.recorder import Recorder, RecorderSection
from groundstation.settings.load import load_field
from groundstation.settings.recorded import recorded_field
from groundstation.settings.resolved import summary_of, yaml_of
from groundstation.settings.schema import Field

FIXTURE = Path(__file__).parents[2] / "fixtures" / "field" / "lab.yaml"
SECRET = "s3cr3t-w0rd"
SOURCES = {
    "cameras.ceiling.source": f"http://operator:{SECRET}@192.168.1.50:8080/video.mjpg",
    "drones.drone_1.camera.source": f"rtsp://operator:{SECRET}@192.168.1.51/live@2",
}
OPTIONS = [f"{path}={source}" for path, source in SOURCES.items()]


@pytest.fixture(scope="module")
def field() -> Field:
    return load_field(FIXTURE, OPTIONS)


def test_each_driver_gets_its_own_password_and_nobody_else_any(field: Field, tmp_path: Path) -> None:
    table = process_table(field, "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=True)
    told = {spec.name: spec.section for spec in table if SECRET in repr(spec)}
    sources = {name: CameraDriverSettings.model_validate_json(text).source for name, text in told.items()}
    assert sources == dict(zip(("ceiling", "drone_1_camera"), SOURCES.values(), strict=True))


def test_written_forms_of_a_field_contain_no_password(field: Field) -> None:
    for text in (yaml_of(field), summary_of(field), field.model_dump_json(), repr(field.model_dump())):
        assert SECRET not in text and "operator" not in text
        assert "192.168.1.50:8080/video.mjpg" in text and "192.168.1.51/live@2" in text


@pytest.mark.parametrize("form", [(), ("--resolved",), ("--json",)])
def test_shown_field_has_no_password(form: tuple[str, ...]) -> None:
    options = [word for option in OPTIONS for word in ("--set", option)]
    result = CliRunner().invoke(config, ["show", str(FIXTURE), *form, *options])
    assert result.exit_code == 0 and SECRET not in result.output and "192.168.1.51" in result.output


def test_recording_has_no_password_and_is_replayed_without(field: Field, tmp_path: Path) -> None:
    class Child:
        bus = MemoryBus(MemoryExchange(), "lab", "recorder")

        def ready(self, detail: str = "") -> None:
            pass

    table = process_table(field, "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=False)
    section = next(spec.section for spec in table if spec.name == "recorder")
    recorder = Recorder(Child(), msgspec.json.decode(section, type=RecorderSection))  # type: ignore[arg-type]
    recorder.turn()
    recorder.close()
    assert all(SECRET.encode() not in path.read_bytes() for path in tmp_path.rglob("*.mcap"))
    recorded = attached_field(tmp_path)
    assert SECRET.encode() not in recorded
    assert recorded_field(recorded).model_dump() == field.model_dump()


@pytest.mark.parametrize(
    "wrong",
    [
        f"cameras.ceiling.source=http://operator:{SECRET}@192.168.1.50:80800/video.mjpg",
        f"cameras.ceiling.source=http://operator:{SECRET}/x@192.168.1.50/video.mjpg",
        f"cameras.ceiling.source=http://operator:x{SECRET}'{SECRET}@192.168.1.50:80800/video.mjpg",
        f"cameras.ceiling.source=htp://operator:x {SECRET}@192.168.1.50/{'long' * 20}",
        f"cameras.ceiling.source=htp://operator:{SECRET * 8}@192.168.1.50/video.mjpg",
        f"cameras.ceiling.source=operator:{SECRET}@192.168.1.50/video.mjpg",
        f"cameras.roof.source=http://operator:{SECRET}@192.168.1.50/video.mjpg",
        f"cameras.ceiling.sauce=http://operator:{SECRET}@192.168.1.50/video.mjpg",
        f"cameras.ceiling.video_delay_ms=http://operator:{SECRET}@192.168.1.50/video.mjpg",
        f"drones.drone_2.camera.source={SOURCES['cameras.ceiling.source']}",
        f"drones.drone_2.camera.source=ardrone://operator:{SECRET}@192.168.1.99",
    ],
)
def test_mistakes_are_named_without_the_password(wrong: str) -> None:
    with pytest.raises(SettingsError) as caught:
        load_field(FIXTURE, [*OPTIONS, wrong])
    assert SECRET not in str(caught.value) and not any(SECRET in problem for problem in caught.value.problems)


def test_errors_and_log_lines_have_no_password() -> None:
    text = f"cannot open rtsp://operator:{SECRET}@cam:554/live (try 'http://operator:{SECRET}@cam')"
    plain = "cannot open rtsp://cam:554/live (try 'http://cam')"
    assert str(DriverError(text)) == plain == without_passwords(text)
    record = logging.LogRecord("x", logging.ERROR, "x", 1, "%s", (text,), None)
    assert DiscreetFormatter("%(message)s").format(record) == plain


@pytest.mark.parametrize(
    ("source", "shown"),
    [
        ("rtsp://me:pass@cam:554/live@2", "rtsp://cam:554/live@2"),
        ("rtsp://me:p@ss@cam/live", "rtsp://cam/live"),
        ("http://me@cam/?a=b@c", "http://cam/?a=b@c"),
        ("http://cam?a=b@c", "http://cam?a=b@c"),
        ("http://[::1]:80/a@b", "http://[::1]:80/a@b"),
        ("ardrone://192.168.1.1", "ardrone://192.168.1.1"),
        ("/dev/v4l/by-id/usb:1@2", "/dev/v4l/by-id/usb:1@2"),
        ("file:///a/b:c@d.mp4", "file:///a/b:c@d.mp4"),
        ("http://me:pa/ss@cam/video", "http://cam/video"),
        ("me:pass@cam/video", "cam/video"),
        ("somebody@example.org", "somebody@example.org"),
    ],
)
def test_only_user_and_password_are_left_out(source: str, shown: str) -> None:
    assert without_password(source) == shown
