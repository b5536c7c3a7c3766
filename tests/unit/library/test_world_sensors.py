"""A foreign package's source of poses, as on the how-to page: accepted, read, and named when broken."""

import json
import re
import socket
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from free_port import free_port

from drivers.motion_capture.settings import OURS, parse_source
from drivers.motion_capture.sources import Source, open_source
from groundstation.errors import DriverError, SettingsError
from groundstation.settings.load import load_field
from groundstation.settings.sections import driver_sections

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "how-to" / "use-skein-as-a-library.md").read_text(encoding="utf-8")
NORTH = [0.0, 0.0, 0.0, 1.0]


@pytest.fixture(autouse=True)
def _installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    (text,) = re.findall(r"```python\n# my_lab/anchors\.py\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "my_lab").mkdir()
    (tmp_path / "my_lab" / "anchors.py").write_text(text)
    (entry,) = re.findall(r'\[project\.entry-points\."skein\.world_sensors"\]\n(.*?)```', PAGE, re.DOTALL)
    info = tmp_path / "my_lab-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-lab\nVersion: 1.0\n")
    broken = "torn = no_such_module:Source\nnatnet = my_lab.anchors:Anchors\n"
    (info / "entry_points.txt").write_text("[skein.world_sensors]\n" + entry.replace('"', "") + broken)
    monkeypatch.syspath_prepend(tmp_path)
    yield
    for name in ("my_lab", "my_lab.anchors"):
        sys.modules.pop(name, None)


@contextmanager
def open_page() -> Iterator[tuple[Source, tuple[str, int]]]:
    """Yield the page's source with the place at which it listens."""
    place = ("127.0.0.1", free_port("127.0.0.1", kind=socket.SOCK_DGRAM))
    source = open_source(parse_source(f"anchors://{place[0]}:{place[1]}"))
    with closing(source):
        yield source, place


def test_poses_of_the_page_are_read() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender, open_page() as (source, place):
        assert source.detail and source.poll(0.0) == []
        for told in (b"{", b'{"cf1": [1]}', json.dumps({"cf1": [1.0, 2.0, 0.5, *NORTH]}).encode()):
            sender.sendto(told, place)
        frames = [frame for _ in range(3) for frame in source.poll(1.0)]
    assert [frame.poses for frame in frames] == [{"cf1": ((1.0, 2.0, 0.5), (0.0, 0.0, 0.0, 1.0))}]
    assert source.rejected == {"damaged": 2} and not source.detail


@pytest.mark.parametrize(
    "told",
    [b'{"b":[null,0,1,0,0,0,1]}', b'{"b":"abcdefg"}', b'{"b":[%s,0,1,0,0,0,1]}' % (b"9" * 401), b"[" * 60000, b"[]"],
)
def test_no_datagram_ends_the_reading(told: bytes) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender, open_page() as (source, place):
        sender.sendto(told, place)
        sender.sendto(json.dumps({"cf1": [1.0, 2.0, 0.5, *NORTH]}).encode(), place)
        assert source.poll(1.0) == [] and source.rejected == {"damaged": 1}
        assert len(source.poll(1.0)) == 1


def test_strangers_are_not_believed() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger, open_page() as (source, place):
        stranger.bind(("127.0.0.2", 0))
        stranger.sendto(json.dumps({"cf1": [1.0, 2.0, 0.5, *NORTH]}).encode(), place)
        assert source.poll(1.0) == [] and source.rejected == {"stranger": 1}


def test_a_field_may_be_rooted_in_it_and_its_driver_is_handed_its_address() -> None:
    field = load_field(ROOT / "config" / "mocap-lab.yaml", ["motion_capture.mocap.source=anchors://0.0.0.0:9400/a?b=1"])
    section = next(one for one in driver_sections(field) if one.name == "mocap")
    address = parse_source(json.loads(section.section)["source"])
    assert (address.scheme, address.host, address.port) == ("anchors", "0.0.0.0", 9400)
    assert (address.path, address.query) == ("a", "b=1")


def test_a_broken_one_is_named_and_the_others_work() -> None:
    with pytest.raises(DriverError, match=r"torn://: torn cannot be used: my-lab .*no_such_module"):
        open_source(parse_source("torn://127.0.0.1"))
    open_source(parse_source("natnet://127.0.0.1")).close()


def test_unknown_source_schemes_are_refused_with_the_valid_ones() -> None:
    with pytest.raises(SettingsError, match=r"motion_capture.mocap.source: must be an address .*anchors://, torn://"):
        load_field(ROOT / "config" / "mocap-lab.yaml", ["motion_capture.mocap.source=radar://1.2.3.4"])


def test_no_plug_in_takes_a_scheme_of_ours() -> None:
    source = open_source(parse_source("natnet://127.0.0.1"))
    assert type(source).__name__ == "NatnetSource" and OURS["natnet"].port == 1510
    source.close()
