"""Cost of writing, opening and seeking a recording, compared with a plain MCAP library."""

import time
from pathlib import Path
from statistics import median
from typing import Any

from mcap.reader import make_reader
from mcap.writer import Writer

from groundstation.bus.api import Sample
from groundstation.recording.run import open_run
from groundstation.recording.synthetic import CLOCK, UNIX_OFFSET_NS, SyntheticRun, turns, write_turn
from groundstation.recording.timeline import Timeline
from groundstation.recording.writing import RunWriter
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field

_SLICE_S = 5.0
_SEEKS = 9


def measure(folder: Path, duration_s: float, seed: int) -> dict[str, Any]:
    """Return the figures of one made-up run, written to a folder."""
    field = load_field(find_field("lab"), ()).model_dump_json().encode()
    figures = _written(folder, field, duration_s, seed)
    state = sorted(folder.glob("state*.mcap"))
    figures["state_mb"] = round(sum(path.stat().st_size for path in state) / 1e6, 1)
    figures["raw_mb"] = round(sum(path.stat().st_size for path in folder.glob("raw*.mcap")) / 1e6, 1)
    return figures | _read(folder) | _peer_read(state[0])


def _written(folder: Path, field: bytes, duration_s: float, seed: int) -> dict[str, Any]:
    writer = RunWriter(folder, field, 1, Timeline(CLOCK, UNIX_OFFSET_NS))
    run, ours_s, peers_s, count, at_s = SyntheticRun(seed), 0.0, 0.0, 0, 0.0
    with (folder / "peer.bin").open("wb") as stream:
        peer = _PeerWriter(stream)
        while at_s < duration_s:
            samples = list(run.samples(at_s, min(at_s + _SLICE_S, duration_s)))
            at_s += _SLICE_S
            count += len(samples)
            begin = time.process_time()
            for turn_ns, turn in turns(samples):
                write_turn(writer, turn, turn_ns)
            middle = time.process_time()
            peer.write(samples)
            ours_s += middle - begin
            peers_s += time.process_time() - middle
        begin = time.process_time()
        writer.close()
        ours_s += time.process_time() - begin
        peers_s += peer.close()
    return {
        "messages": count,
        "duration_s": duration_s,
        "write_us_per_message": round(1e6 * ours_s / count, 2),
        "peer_write_us_per_message": round(1e6 * peers_s / count, 2),
        "write_ratio_to_peer": round(ours_s / peers_s, 2),
        "write_percent_of_core": round(100.0 * ours_s / duration_s, 2),
    }


class _PeerWriter:
    """The same payloads into one file with the MCAP library's defaults: no header checks, no flush, no splitting."""

    def __init__(self, stream: Any) -> None:
        self._writer = Writer(stream)
        self._writer.start()
        self._channels: dict[str, int] = {}

    def write(self, samples: list[tuple[int, Sample]]) -> None:
        channels, writer = self._channels, self._writer
        for stamp_ns, sample in samples:
            channel = channels.get(sample.key)
            if channel is None:
                channel = channels[sample.key] = writer.register_channel(sample.key, "json", 0)
            writer.add_message(channel, stamp_ns, bytes(sample.payload), stamp_ns)

    def close(self) -> float:
        begin = time.process_time()
        self._writer.finish()
        return time.process_time() - begin


def _cpu(step: Any) -> float:
    begin = time.process_time()
    step()
    return time.process_time() - begin


def _read(folder: Path) -> dict[str, Any]:
    opened = [_cpu(lambda: open_run(folder)) for _ in range(3)]
    run = open_run(folder)

    def seek(at_ns: int) -> None:
        run.latest_before(at_ns)
        next(run.records_from(at_ns), None)

    span = run.end_ns - run.start_ns
    seeks = [_cpu(lambda n=n: seek(run.start_ns + span * n // (_SEEKS + 1))) for n in range(1, _SEEKS + 1)]
    everything = _cpu(lambda: sum(1 for _ in run.records_from(run.start_ns, lambda topic: topic.type is not None)))
    return {
        "open_s": round(median(opened), 4),
        "seek_s": round(max(seeks), 4),
        "seek_median_s": round(median(seeks), 4),
        "read_all_state_s": round(everything, 2),
    }


def _peer_read(path: Path) -> dict[str, Any]:
    with path.open("rb") as stream:

        def reader() -> Any:
            stream.seek(0)
            return make_reader(stream)

        opened = median(_cpu(lambda: reader().get_summary()) for _ in range(3))
        facts = reader().get_summary().statistics
        at_ns = (facts.message_start_time + facts.message_end_time) // 2
        # Only the next message; our seek also includes the latest value of each key before it.
        seek = median(_cpu(lambda: next(reader().iter_messages(starting_at=at_ns))) for _ in range(3))
    return {"peer_open_s": round(opened, 4), "peer_seek_s": round(seek, 4)}
