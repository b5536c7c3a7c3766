"""The table of topics in groundstation/bus/README.md is the one of the code."""

from pathlib import Path

from groundstation.bus.topics import TOPICS, Topic

README = Path(__file__).parents[2] / "groundstation" / "bus" / "README.md"
HEADER = "| topic | message | rate [Hz] | delivery | plane |\n|---|---|---|---|---|"


def row(topic: Topic) -> str:
    kind = f"`{topic.type.__name__}`" if topic.type is not None else topic.encoding
    rate = f"{topic.rate_hz:g}" if topic.rate_hz else "on occasion"
    return f"| `{topic.name}` | {kind} | {rate} | {topic.quality} | {topic.plane or 'production'} |"


def test_the_table_of_topics_is_in_sync() -> None:
    table = "\n".join([HEADER, *map(row, TOPICS.values())])
    assert table in README.read_text(encoding="utf-8"), f"put this table into {README.name}:\n{table}"
