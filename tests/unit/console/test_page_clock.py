"""The page's idea of the server's time, on links that delay what comes or what goes."""

from typing import Any

import pytest
from page_modules import LINK, needs_node

pytestmark = needs_node

# A link between two clocks, that of the server 1000 s ahead: a frame each 50 ms, the page's answers, and an order.
_DELAYED = f"""
const started = performance.now();
let shift = 0;
Date.now = () => 1e12 + performance.now() - started + shift;
{LINK}
const {{ ageS, estimateAge, linkSlow, now, trackerSilent }} = await import("./store.js");
const {{ give }} = await import("./own_orders.js"), {{ ownAlarms }} = await import("./own_alarms.js");
const server = () => performance.now() + 1e6;
const due = [], later = (ms, act) => {{ due.push([performance.now() + ms, act]); }};
let up = 1, down = 1, seq = 0, answer, handled = 0;
function deliver() {{
  for (const one of due.filter(([at]) => at <= performance.now()).sort(([a], [b]) => a - b)) {{
    due.splice(due.indexOf(one), 1);
    one[1]();
  }}
}}
function takeSent() {{
  for (const {{ sent_ms }} of sockets.at(-1).sent.splice(0).filter(({{ type }}) => ["seen", "hello"].includes(type))) {{
    later(up, () => {{ answer = [sent_ms, server()]; }});
  }}
}}
function frame() {{
  const estimate = {{ at: server() - 20, entities: [], searches: {{}} }};
  const told = {{ type: "delta", seq: ++seq, now: server(), s: {{ estimate }} }};
  if (answer) told.answer = answer;
  answer = undefined;
  later(down, () => hear(told));
}}
function fly(s) {{
  for (let k = 0; k < 100 * s; k++) {{
    wait(10);
    deliver();
    takeSent();
    if (k % 5 === 0) frame();
  }}
}}
function begin() {{
  sockets[0].onopen();
  const [{{ sent_ms }}] = sockets[0].sent.splice(0);
  later(up, () => {{ const met = server(); later(down, () => hear(welcome({{ answer: [sent_ms, met] }}))); }});
  later(up, () => {{ const first = seed(++seq, {{ now: server() }}); later(down, () => hear(first)); }});
  for (let k = 0; k < 1300; k++) {{ wait(10); deliver(); }}
  takeSent();
}}
const error = () => now() - server();
function order() {{
  sockets.at(-1).sent.splice(0);
  give("HOLD");
  const {{ at_ms, unsure_ms }} = sent("order").at(-1);
  return [server() - at_ms, unsure_ms];
}}
"""


@pytest.mark.parametrize("first_ms", [1, 6000], ids=["quick at first", "slow from the start"])
def test_a_delay_of_what_comes_is_never_taken_for_a_late_clock(said: Any, first_ms: int) -> None:
    script = f"""{_DELAYED}
    down = {first_ms}; begin(); fly(10); down = 6000; fly(60);
    const titles = ownAlarms().map(({{ title }}) => title);
    const result = [error(), estimateAge(), linkSlow(), trackerSilent(), titles, ...order()];
    """
    error_ms, age_s, slow, tracker_silent, alarms, at_most_ms, unsure_ms = said(script)
    assert 0 <= error_ms < 50
    assert 6.0 <= age_s < 6.2
    assert slow and not tracker_silent
    (alarm,) = alarms
    assert alarm.startswith("SLOW LINK: what you see is 6.")
    # It was given just now: what the page does not know of the server's time is in favour of a stop.
    assert at_most_ms - unsure_ms <= 5
    assert at_most_ms < (50 if first_ms < 1000 else 6100)


def test_a_delay_of_what_goes_makes_nothing_older(said: Any) -> None:
    script = f"""{_DELAYED}
    begin(); fly(10); up = 6000; fly(120);
    const result = [error(), estimateAge(), linkSlow(), ...order()];
    """
    error_ms, age_s, slow, at_most_ms, unsure_ms = said(script)
    assert 0 <= error_ms < 120 and age_s < 0.2 and not slow
    assert at_most_ms < 50 and unsure_ms < 200, "so the server knows how long the order was on its way"


def test_a_machine_that_slept_knows_the_time_by_its_other_clock(said: Any) -> None:
    """`performance.now()` may stand still during sleep."""
    script = f"""{_DELAYED}
    begin(); fly(10);
    const before = now();
    shift = 20000;
    const result = [now() - before];
    """
    (passed_ms,) = said(script)
    assert passed_ms >= 19_000


def test_a_clock_that_was_set_forward_is_believed_no_longer_than_a_round_trip(said: Any) -> None:
    script = f"""{_DELAYED}
    begin(); fly(10);
    shift = 3600e3;
    fly(1);
    const result = [error(), ...order()];
    """
    error_ms, at_most_ms, unsure_ms = said(script)
    assert abs(error_ms) < 50 and abs(at_most_ms) < 50 and unsure_ms < 100
