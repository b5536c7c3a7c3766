"""Page modules that need no browser, run by node: words in the bar, on buttons and in speech."""

from typing import Any

import pytest
from page_modules import LINK, needs_node

pytestmark = needs_node


def test_the_worst_battery_is_told_though_another_drone_was_never_heard(said: Any) -> None:
    script = """
    const { worstBattery } = await import("./batteries.js");
    const result = [worstBattery()];
    store.s.vehicles = heard({ drone_1: [0.18, "empty"] });
    result.push(worstBattery());
    """
    nothing, worst = said(script)
    assert nothing is None
    assert (worst["name"], worst["words"], worst["level"]) == ("drone_1", "18 %", "bad")


def test_each_battery_that_runs_low_is_heard_whatever_is_known_of_the_others(said: Any) -> None:
    script = """
    const { listen } = await import("./sounds.js");
    const flown = [{ drone_2: [null, "unknown"] }, { drone_1: [0.6, "good"], drone_2: [null, "unknown"] },
      { drone_1: [0.28, "low"], drone_2: [null, "unknown"] }, { drone_1: [0.28, "low"], drone_2: [0.19, "empty"] },
      { drone_1: [0.19, "empty"], drone_2: [0.19, "empty"] }];
    for (const charges of flown) { store.s.vehicles = heard(charges); listen(); }
    const result = spoken;
    """
    assert said(script) == ["battery drone_1 low", "battery drone_2 empty", "battery drone_1 empty"]


_ALARMS = """
const { listen } = await import("./sounds.js");
const alarm = (about, text) => ({ about, text, grave: true, asks: false, told: null, advice: "" });
const beat = (alarms = [], orders = []) => { Object.assign(store.s, { alarms, orders }); listen(); wait(200); };
const silent = (s) => alarm("drone_1 silent", `drone_1: nothing heard for ${s} s`);
const hold = (id) => [{ id, verb: "HOLD", given_ms: performance.now(), rows: [] }];
"""


def test_an_alarm_sounds_once_while_its_figures_change(said: Any) -> None:
    script = f"""{_ALARMS}
    for (let s = 1; s < 9; s++) beat([silent(s)]);
    beat();
    beat([silent(10)]);
    beat([alarm("tracker silent", "tracker: no estimate for 0.4 s"), silent(11)]);
    for (let k = 0; k < 15; k++) beat();
    beat([silent(1)]);
    const result = spoken;
    """
    begins = "drone_1: nothing heard for 1 s"
    assert said(script) == [begins, "tracker: no estimate for 0.4 s", begins]


def test_an_alarm_that_stands_is_not_said_again_by_a_page_that_rarely_looks(said: Any) -> None:
    script = f"""{_ALARMS}
    for (const s of [1, 61, 121]) {{ beat([silent(s)]); wait(60000); }}
    const result = spoken;
    """
    assert said(script) == ["drone_1: nothing heard for 1 s"]


def test_a_stop_is_said_to_its_end_and_at_once(said: Any) -> None:
    script = f"""{_ALARMS}
    beat([silent(1)]);
    beat([silent(2)], hold("a"));
    beat([silent(3), alarm("drone_2 lands", "drone_2 starts to land in 9 s: unseen")]);
    beat([], hold("b"));
    const result = played;
    """
    alarms = "drone_1: nothing heard for 1 s", "drone_2 starts to land in 9 s: unseen"
    assert said(script) == ["cut off", alarms[0], "cut off", "hold", alarms[1], "cut off", "hold"]


def test_alarms_of_the_page_itself_are_heard(said: Any) -> None:
    script = f"""{_ALARMS}
    beat();
    store.receivedAt = performance.now() - 900;
    beat(); beat();
    store.connected = false;
    beat();
    Object.assign(store, {{ connected: true, receivedAt: Infinity }});
    const [given] = hold("a");
    wait(5000);
    beat([], [{{ ...given, rows: [{{ name: "drone_1", stage: "" }}] }}]);
    store.s.ended = {{ text: "the run broke off: drone_1 may fly", severity: "ERROR", at: 0, down: false }};
    beat(); beat();
    const result = spoken;
    """
    silence, order = "CONSOLE SILENT for 0.9 s", "HOLD NOT CONFIRMED: no answer from drone_1"
    assert said(script) == [silence, "NO CONNECTION TO THE CONSOLE", order, "the run broke off: drone_1 may fly"]


def test_a_stop_that_is_refused_is_an_alarm_unless_the_drone_does_more(said: Any) -> None:
    script = """
    const { ownAlarms } = await import("./own_alarms.js");
    const title = (verb, modes, reason, id = "a") => {
      const rows = Object.keys(modes).map((name) => ({ name, stage: "REFUSED", reason }));
      store.s.vehicles = Object.fromEntries(Object.entries(modes).map(([name, mode]) => [name, { mode }]));
      store.s.orders = [{ id, verb, given_ms: performance.now() - 1000, state: "refused", rows }];
      return ownAlarms().map(({ title }) => title);
    };
    const old = (verb, ...modes) => title(verb, { drone_1: modes[0], drone_2: modes[1] }, "given 41 s ago", verb);
    const result = [old("HOLD", "TRACK", "TRACK"), old("LAND", "TRACK", "LANDING"), old("CUT_MOTORS", "CUT", "LANDING"),
      title("HOLD", { drone_1: "LANDING" }, "LANDING goes before HOLD"),
      title("LAND", { drone_1: "CUT" }, "motors are cut"),
      title("HOLD", { drone_1: "TAKING_OFF" }, "LANDING goes before HOLD")];
    """
    assert said(script) == [
        ["HOLD REFUSED by drone_1, drone_2: given 41 s ago"],
        ["LAND REFUSED by drone_1: given 41 s ago"],
        ["CUT MOTORS REFUSED by drone_2: given 41 s ago"],
        *([], [], []),
    ]


def test_each_target_is_heard_to_be_lost_and_found(said: Any) -> None:
    script = f"""{_ALARMS}
    const unseen = (ages) => {{
      const entities = Object.entries(ages).map(([name, age_s]) => ({{ name, age_s, mean: [0, 0] }}));
      store.s.estimate = {{ at: performance.now(), entities, searches: {{}} }};
      beat();
    }};
    store.scene.targets = [{{ name: "cart" }}, {{ name: "turtlebot" }}];
    unseen({{ cart: 0.1, turtlebot: 1e6 }}); // never seen
    unseen({{ cart: 0.1, turtlebot: 0.1 }});
    unseen({{ cart: 0.1, turtlebot: 7 }});
    unseen({{ cart: 7 }}); // the tracker has given up the other
    wait(5000); beat(); // no tracker
    unseen({{ cart: 7, turtlebot: 0.1 }});
    store.scene.targets = [{{ name: "cart" }}];
    unseen({{ cart: 0.1 }});
    const result = spoken;
    """
    assert said(script) == ["turtlebot lost", "cart lost", "turtlebot found", "target found"]


def test_a_drone_that_is_not_heard_yet_is_not_said_to_stand(said: Any) -> None:
    script = """
    const { verdict } = await import("./verdict.js");
    const { effectOf, effectOnOne, isIdle } = await import("./effects.js");
    const is = (flight, mode) => ({ flight, mode, at: performance.now(), detail: "", battery: null, lands_in_s: null });
    const words = (drones) => { store.s.vehicles = drones;
      return [verdict().split(".")[0], effectOf("HOLD"), isIdle("LAND"), effectOnOne("LAND", "drone_1")]; };
    const connecting = is("UNKNOWN", "CONNECTING"), stands = is("LANDED", "LANDED"), lost = is("LOST", "CONNECTING");
    const result = [words({ drone_1: connecting, drone_2: connecting }), words({ drone_1: lost, drone_2: stands }),
      words({ drone_1: is("LOST", "LANDED"), drone_2: stands })];
    """
    stops = ["if one flies", False, "if it flies"]
    assert said(script) == [
        ["It is not known whether drone_1 and drone_2 fly", *stops],
        ["It is not known whether drone_1 flies", *stops],
        ["Nobody flies", "nobody flies", True, "no use: stands"],
    ]


_TEAM = """
const { effectOf, effectOnOne, mayFail, refusalOf, startEffect } = await import("./effects.js");
const { dutyOf } = await import("./duty.js");
const is = (mode, more = {}) => ({ mode, flight: mode === "CUT" ? "LANDED" : "FLYING", battery: 0.8, battery_min: 0.15,
  at: performance.now(), detail: "", lands_in_s: null, braked: false, ...more });
const seen = (names) => {
  const entities = names.map((name) => ({ name, age_s: 0.1, mean: [0, 0, 1] }));
  store.s.estimate = { at: performance.now(), entities, searches: {} };
};
"""


@pytest.mark.parametrize("flight", ["LANDED", "EMERGENCY"])
def test_a_drone_with_cut_motors_takes_off_only_after_a_look_at_it(said: Any, flight: str) -> None:
    script = f"""{_TEAM}
    seen(["drone_1"]);
    store.s.vehicles = {{ drone_1: is("TRACK"), drone_2: is("CUT", {{ flight: "{flight}" }}) }};
    const start = (...whom) => refusalOf("TAKEOFF", ...whom);
    const captions = () => [start(), start(["drone_2"]), mayFail("drone_2"), dutyOf("drone_2")];
    const result = [captions(), effectOf("HOLD"), effectOnOne("LAND", "drone_2")];
    store.s.vehicles.drone_1 = is("LANDED", {{ flight: "LANDED" }});
    result.push(start(["drone_2"]), startEffect("TAKEOFF"));
    """
    check, fell = "check drone_2", "Is on the floor: it cut its motors itself."
    one, captions = [check, check, True, fell], ["drone_1 hovers;\ndrone_2 is down", "no use: down"]
    assert said(script) == [one, *captions, "", "both rise, if able"]


def test_each_seed_is_answered(said: Any) -> None:
    script = f"""{LINK}
    hear(seed(1));
    hear(welcome());
    for (const seq of [2, 3]) hear(seed(seq));
    const result = sent("seen").map(({{ seq }}) => seq);
    """
    assert said(script) == [1, 2, 3]


def test_each_frame_is_answered_while_pictures_are_watched_which_wait_for_it(said: Any) -> None:
    script = f"""{LINK}
    const {{ watch }} = await import("./link.js"), delta = (seq) => ({{ type: "delta", seq, now: 0, s: {{}} }});
    hear(seed(1));
    hear(welcome());
    for (const seq of [2, 3, 4, 5]) hear(delta(seq));
    watch(["ceiling"]);
    for (const seq of [6, 7]) hear(delta(seq));
    const result = sent("seen").map(({{ seq }}) => seq);
    """
    assert said(script) == [1, 4, 6, 7]


def test_a_held_key_drives_a_target_by_the_clock_alone(said: Any) -> None:
    script = f"""{LINK}
    const {{ startSteering }} = await import("./steer.js"), hears = {{}};
    store.scene.truth = true;
    const keydown = {{ preventDefault() {{}}, target: null }};
    startSteering({{ addEventListener: (kind, heard) => {{ hears[kind] = heard; }} }}, {{}});
    for (let k = 0; k < 80; k++) hears.keydown({{ ...keydown, key: "ArrowUp", repeat: k > 0 }});
    const one = sent("drive").length;
    hears.keydown({{ ...keydown, key: "ArrowLeft" }});
    await new Promise((over) => setTimeout(over, 350));
    const held = sent("drive").length;
    for (const key of ["ArrowUp", "ArrowLeft"]) hears.keyup({{ key }});
    const result = [one, held, sent("drive").at(-1)];
    """
    one, held, last = said(script)
    assert one == 1
    assert 3 <= held <= 6
    assert (last["speed_m_s"], last["turn_rad_s"]) == (0, 0)


def test_only_the_operators_page_steers(said: Any) -> None:
    script = f"""{LINK}
    const {{ maySteer }} = await import("./steer.js");
    store.scene.truth = true;
    hear(welcome({{ name: "viewer 7" }}));
    const result = ["viewer 7", "", "viewer 8", "console_laptop_77"].map((operator) => {{
      store.s.session = {{ operator }};
      return maySteer();
    }});
    """
    assert said(script) == [True, True, False, False]


def test_a_held_key_steps_a_replay_twenty_times_a_second(said: Any) -> None:
    script = f"""{LINK}
    const {{ playbackKey }} = await import("./playback.js");
    store.scene.replay = {{ start_ms: 0, end_ms: 60000, marks: [] }};
    const ours = [], keydown = {{ preventDefault() {{}}, target: null }};
    for (let k = 0; k < 81; k++) {{ ours.push(playbackKey({{ ...keydown, key: ".", repeat: k > 0 }})); wait(13); }}
    for (let k = 0; k < 5; k++) playbackKey({{ ...keydown, key: ",", repeat: false }});
    const result = [sent("step").filter(({{ ticks }}) => ticks > 0).length, sent("step").length, ours.every(Boolean),
      playbackKey({{ ...keydown, key: "Tab", repeat: true }})];
    """
    assert said(script) == [21, 26, True, False]


def test_a_team_without_targets_does_not_search(said: Any) -> None:
    script = f"""{_TEAM}
    const {{ teamMode, stageWord }} = await import("./glance.js"), {{ verdict }} = await import("./verdict.js");
    seen(["drone_1", "drone_2"]);
    store.s.vehicles = {{ drone_1: is("TRACK"), drone_2: is("TRACK") }};
    store.s.plan = {{ at: performance.now(), edges: [], controls: [] }};
    const line = verdict().split(".")[0];
    const result = [teamMode()[0], stageWord("track"), refusalOf("TRACK"), line, dutyOf("drone_1", 95)];
    """
    words = ["TRACK", "track", "tracking already", "drone_1 and drone_2 track the target"]
    *captions, card = said(script)
    assert captions == words
    assert card.startswith("Tracks its target")


@pytest.mark.parametrize("in_belief", [False, True])
def test_no_seconds_are_stated_for_a_drone_that_nobody_has_ever_seen(said: Any, in_belief: bool) -> None:
    script = f"""{_TEAM}
    const {{ landingWords, verdict }} = await import("./verdict.js");
    store.scene.targets = [{{ name: "turtlebot" }}];
    seen(["turtlebot", "drone_2"]);
    if ({str(in_belief).lower()}) store.s.estimate.entities.push({{ name: "drone_1", age_s: 1e6, mean: [0, 0, 1] }});
    store.s.vehicles = {{ drone_1: is("HOVER", {{ detail: "hovers" }}), drone_2: is("TRACK") }};
    const result = [landingWords(), dutyOf("drone_1"), verdict()];
    store.s.estimate.entities.find(({{ name }}) => name === "drone_2").age_s = 10;
    result.push(landingWords());
    """
    never, card, line, both = said(script)
    assert (never, card) == ("unseen: one\nlands unless seen", "Hovers. Not seen yet: lands by itself, unless seen.")
    assert "Lost: drone_1, not seen yet." in line
    assert both == "unseen: both\nland unless seen"


def test_a_target_that_may_be_anywhere_is_unseen_but_has_no_place_on_the_map(said: Any) -> None:
    script = """
    const { entities, entity, placed, unseenS } = await import("./store.js");
    const target = { name: "turtlebot", kind: "target", mean: [12.8, -11.5], age_s: 65, anywhere: true };
    store.s.estimate = { at: performance.now(), entities: [target, { name: "drone_1", mean: [0, 0, 1], age_s: 0 }] };
    const result = [entities().map(({ name }) => name), placed("turtlebot") ?? null, entity("turtlebot").name];
    result.push(Math.round(unseenS("turtlebot")));
    """
    assert said(script) == [["drone_1"], None, "turtlebot", 65]


def test_a_double_click_starts_once_and_stops_twice(said: Any) -> None:
    """After an emergency the first TAKEOFF only ends that, and the second starts motors."""
    script = f"""{LINK}
    const {{ give }} = await import("./own_orders.js");
    sockets[0].onopen();
    hear(welcome());
    hear(seed(1));
    for (const verb of ["TAKEOFF", "LAND"]) for (const ms of [24, 900, 100]) {{ give(verb, []); wait(ms); }}
    give("TAKEOFF", ["drone_1"]);
    give("TAKEOFF", ["drone_2"]);
    wait(1000);
    give("TAKEOFF", ["drone_2"]);
    const result = sent("order").map(({{ verb, drones }}) => [verb, ...drones].join(" "));
    """
    assert said(script) == [
        "TAKEOFF",
        *["LAND"] * 3,
        "TAKEOFF drone_1",
        *["TAKEOFF drone_2"] * 2,
    ]
