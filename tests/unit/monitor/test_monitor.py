"""The monitor's display of a given state."""

import io
import re
from itertools import takewhile
from pathlib import Path

import pytest
from monitor_world import CAST, NOW, S, World, plan, sighting
from rich.console import Console

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.cli.terminal import show
from groundstation.field.resolved import ResolvedField
from groundstation.monitor.screen import DRAW_PERIOD_NS, Screen, line
from groundstation.monitor.state import cast_from_field
from groundstation.monitor.table import render

DOCS = Path(__file__).parents[3] / "docs"


def test_texts_of_devices_cannot_command_the_terminal(world: World) -> None:
    forged = "\x1b[2J\x1b]0;owned\x07\nall is well\x9b1A"
    world.say(t.EVENT, m.Event(header=world.header("drone_1"), severity=m.Severity.ERROR, text=forged, remedy=forged))
    world.vehicle(f"drone_9{forged}", detail=forged, lands_in_s=6.0)
    world.camera(f"ceiling{forged}", connected=False, detail=forged)
    world.screen._console.width = 400
    assert "owned" in world.text()
    drawn = world.output.getvalue() + line(world.state, NOW)
    assert "\ufffd[2J\ufffd]0;owned\ufffd\ufffdall is well\ufffd1A" in drawn
    assert all(sign not in drawn for sign in ("\x1b[2J", "\x1b]0", "\x07", "\x9b"))
    assert all(not row.strip().startswith("all is well") for row in drawn.splitlines())


def test_an_empty_state_is_drawn(world: World) -> None:
    text = world.text()
    assert "no word yet" in text and "no plan yet" in text


def test_the_table_shows_mode_battery_link_position_and_ellipse(world: World) -> None:
    world.vehicle("drone_1")
    world.estimate()
    world.say(t.OBSERVATION, sighting(world, "drone_1"))
    text = world.text()
    (row,) = (line for line in text.splitlines() if line.startswith("drone_1 "))
    for part in ("TRACK", "80%", "200 Hz", "0.2 s", "1.25  -0.50   1.30", "0.24 x 0.24", "nobody"):
        assert part in row
    (row,) = (line for line in text.splitlines() if line.startswith("turtlebot"))
    for part in ("0.75   0.25", "0.49 x 0.24", "drone_1"):
        assert part in row


def test_a_search_is_shown_with_its_place(world: World) -> None:
    search = m.TargetSearch("turtlebot", "SEARCH", 4.0, (1.2, -0.5), 0.3, 9.0, "now around (1.2, -0.5)")
    world.estimate(0.1, 0.0, search)
    assert "turtlebot SEARCH: now around (1.2, -0.5)" in world.text()


@pytest.mark.parametrize(("unseen_s", "told"), [(0.4, False), (0.8, True), (3.5, False)])
def test_a_target_that_may_be_hidden_is_shown_with_its_place_until_an_alarm_tells_of_it(
    world: World, unseen_s: float, told: bool
) -> None:
    world.estimate(unseen_s)
    sentence = f"turtlebot is not seen for {unseen_s} s: it may be hidden near (0.8, 0.2)"
    assert (sentence in world.text()) == told
    world.estimate(unseen_s, 0.0, m.TargetSearch("turtlebot", "SEARCH", 4.0, (1.2, -0.5), 0.3, 9.0, "searched"))
    assert "may be hidden" not in world.text()


@pytest.mark.parametrize("width", [40, 60, 80, 100, 120, 140])
def test_names_are_whole_in_any_terminal(world: World, width: int) -> None:
    world.vehicle("drone_1", mode="TAKING_OFF")
    world.vehicle("drone_2")
    world.estimate()
    for observer in ("ceiling", "drone_1", "drone_2"):
        world.say(t.OBSERVATION, sighting(world, observer))
    world.text()
    console = Console(record=True, width=width, file=io.StringIO())
    console.print(render(world.state, NOW))
    rows = console.export_text().splitlines()
    assert all(any(row.startswith(name) for row in rows) for name in ("drone_1", "drone_2", "turtlebot"))
    assert not any("…" in row for row in rows)
    assert any("mode" in row and "position [m]" in row for row in rows) == (width >= 60)  # where there is room


def test_columns_give_way_in_the_order_that_the_page_says(world: World) -> None:
    page = " ".join((DOCS / "tutorials" / "first-demo.md").read_text("utf-8").split())
    listed = re.search(r"drops columns: first ([^.]*)\.", page)
    assert listed is not None
    order = re.split(r", then |, | and ", listed[1])
    world.vehicle("drone_1")
    seen = set()
    for width in range(160, 20, -2):
        console = Console(record=True, width=width, file=io.StringIO())
        console.print(render(world.state, NOW))
        rows = console.export_text().splitlines()
        heads = " ".join(takewhile(lambda row: not row.startswith("drone_1"), rows))
        spared = [name for name in order if name not in heads]
        assert spared == order[: len(spared)], (width, heads)
        seen.add(len(spared))
    assert max(seen) >= 5, "no width was narrow enough to tell the order"


def test_a_pipe_gets_everything(world: World, capsys: pytest.CaptureFixture[str]) -> None:
    world.vehicle("drone_1")
    world.estimate()
    world.say(t.PLAN, plan(world))
    world.text()
    show(render(world.state, NOW))
    printed = capsys.readouterr().out
    assert "vehicle" in printed and "seen by" in printed and "…" not in printed
    (row,) = (row for row in printed.splitlines() if row.startswith("topology"))
    assert row.endswith("instead of drone_1 + drone_2 150 cm²")


def test_the_plan_is_shown_beside_its_alternatives(world: World) -> None:
    world.say(t.PLAN, plan(world))
    text = world.text()
    assert "drone_1 over drone_2" in text and "123 cm²" in text and "12 ms" in text
    assert "instead of drone_1 + drone_2 150 cm²" in text


def test_a_command_is_not_confirmed_until_each_drone_has_answered(world: World) -> None:
    answer = m.CommandAck(header=world.header("drone_1"), command_id="7", verb=m.Verb.LAND, stage=m.AckStage.EFFECTIVE)
    world.say(t.COMMAND_ACK, answer)  # arrives before its command
    world.say(t.COMMAND, m.Command(header=world.header("team"), id="7", verb=m.Verb.LAND, scope=(), issuer="me"))
    text = world.text()
    assert "drone_1 effective" in text
    assert "drone_2 NOT CONFIRMED" in text


def test_requests_to_the_operator_need_no_answer_of_a_drone(world: World) -> None:
    asked = m.Command(
        header=world.header("operator"), id="8", verb=m.Verb.TAKEOFF, scope=(m.OPERATOR, "drone_1"), issuer="me"
    )
    world.say(t.COMMAND, asked)
    assert "operator NOT CONFIRMED" in world.text()
    answer = m.CommandAck(
        header=world.header(m.OPERATOR), command_id="8", verb=m.Verb.TAKEOFF, stage=m.AckStage.ACCEPTED
    )
    world.say(t.COMMAND_ACK, answer)
    text = world.text()
    assert "operator accepted" in text and "NOT CONFIRMED" not in text


def test_alarms_beyond_the_room_are_counted(world: World) -> None:
    for number in range(8):
        world.vehicle(f"drone_{number}", battery=0.05)
    text = world.text()
    left = text.split(" and ")[1].split(" more")[0]
    assert int(left) >= 3 and "the console's page has all" in text


def test_an_order_is_shown_above_what_grows_with_the_team(world: World) -> None:
    world.say(t.PLAN, plan(world))
    world.camera("ceiling")
    world.say(t.COMMAND, m.Command(header=world.header("team"), id="7", verb=m.Verb.LAND, scope=(), issuer="me"))
    text = world.text()
    assert text.index("NOT CONFIRMED") < min(text.index("topology"), text.index("cameras"))


def test_processes_and_events_are_listed(world: World) -> None:
    world.status("tracker")
    event = m.Event(header=world.header("drone_2", 3.0), severity=m.Severity.WARNING, text="wind", remedy="land")
    world.say(t.EVENT, event)
    text = world.text()
    assert "tracker 34% 2% late" in text and "together 0.34 cores" in text
    assert "3 s ago  drone_2: wind  (land)" in text


def test_the_screen_draws_four_times_a_second_and_gives_the_terminal_back(world: World) -> None:
    with world.screen as screen:
        for step in range(100):
            screen.turn(NOW + step * DRAW_PERIOD_NS // 10)
        drawn = world.output.getvalue().count("skein")
    assert 9 <= drawn <= 12
    assert world.output.getvalue().startswith("\x1b[?1049h")
    assert "\x1b[?1049l" in world.output.getvalue()


def test_a_closed_terminal_does_not_end_the_process(world: World) -> None:
    with world.screen as screen:

        def broken(_text: str) -> int:
            raise OSError(5, "Input/output error")

        world.output.write = broken
        screen.turn(NOW)
        screen.turn(NOW + S)


def test_without_a_terminal_it_prints_a_line_now_and_then() -> None:
    output = io.StringIO()
    bus = MemoryBus(MemoryExchange(), "lab", "monitor")
    with Screen(bus, CAST, NOW, Console(file=output, force_terminal=False)) as screen:
        for second in range(11):
            screen.turn(NOW + second * S)
    assert len(output.getvalue().splitlines()) == 3


def test_a_terminal_that_cannot_be_drawn_on_gets_lines_as_well() -> None:
    output = io.StringIO()
    bus = MemoryBus(MemoryExchange(), "lab", "monitor")
    console = Console(file=output, force_terminal=True, _environ={"TERM": "dumb"})
    with Screen(bus, CAST, NOW, console) as screen:
        for second in range(11):
            screen.turn(NOW + second * S)
    assert len(output.getvalue().splitlines()) == 3 and "\x1b" not in output.getvalue()


def test_the_line_names_modes_and_alarms(world: World) -> None:
    world.vehicle("drone_1", mode="HOLD", battery=0.1)
    world.text()
    assert line(world.state, NOW) == "  100 s  drone_1 HOLD; ! drone_1: battery 10%, good for < 1 min"


def test_the_cast_comes_from_the_resolved_field(lab_field: ResolvedField) -> None:
    assert cast_from_field(lab_field) == CAST
