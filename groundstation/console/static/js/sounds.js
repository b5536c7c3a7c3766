// What is worth hearing and feeling: stops, alarms, a battery that runs low, a lost target. Muting silences all but stops.

import { byId } from "./dom.js";
import { BREAK_MS, ownAlarms } from "./own_alarms.js";
import { entity, NEVER_S, now, replaying, runOver, shownEstimateAge, store, trackerSilent } from "./store.js";

const KEY = "skein-muted", NEW_MS = 3000, SAYING_MS = 3000;
const STOPS = { HOLD: "hold", LAND: "landing", CUT_MOTORS: "motors cut" };
// The tone [Hz], and for how many milliseconds by turns a device in the hand shakes and rests.
const CUES = {
  stop: { hertz: 880, shakes: [400] },
  alarm: { hertz: 520, shakes: [150, 100, 150] },
  battery: { hertz: 520, shakes: [150, 100, 150] },
  lost: { hertz: 440, shakes: [150, 100, 150, 100, 150] },
  found: { hertz: 660, shakes: [] },
};
const SCARCE = new Set(["low", "empty"]); // charges that are heard: of one that is unknown the page tells
// Grave alarms by what they are about: null while they stand, then when they ended.
const heard = new Set(), known = new Map();
let muted = false, before = { charges: {}, lost: new Set() }, stopUntil = -Infinity, context = null;

export function startSounds() {
  const button = byId("sound");
  const show = () => button.setAttribute("aria-pressed", `${!muted}`);
  try { muted = Boolean(localStorage.getItem(KEY)); } catch { /* then it is heard */ }
  const toggle = () => {
    muted = !muted;
    try { localStorage.setItem(KEY, muted ? "1" : ""); } catch { /* it lasts until the page goes */ }
    show();
  };
  button.onclick = toggle;
  show();
  return toggle;
}

export function listen() {
  if (replaying() || !store.scene) return;
  announce([...stops(), ...charges(), ...targets(), ...begun().map((words) => ["alarm", words])]);
}

// Stops given just now, the oldest first: [cue, words], as of all that follow.
function stops() {
  const fresh = (store.s.orders ?? []).filter(({ id, verb }) => STOPS[verb] && !heard.has(id)).sort((a, b) => a.given_ms - b.given_ms);
  fresh.forEach(({ id }) => heard.add(id));
  return fresh.filter(({ given_ms: at }) => now() - at < NEW_MS).map(({ verb }) => ["stop", STOPS[verb]]);
}

function charges() {
  const after = Object.fromEntries(Object.entries(store.s.vehicles ?? {}).map(([name, { charge }]) => [name, charge])), { charges: old } = before;
  before.charges = after;
  return Object.entries(after).filter(([name, charge]) => SCARCE.has(charge) && charge !== old[name]).map(([name, charge]) => ["battery", `battery ${name} ${charge}`]);
}

function targets() {
  const all = store.scene.targets.map(({ name }) => name), old = before.lost, after = new Set(all.filter(isGone));
  before.lost = after;
  const called = (name) => (all.length > 1 ? name : "target");
  return all.filter((name) => after.has(name) !== old.has(name)).map((name) => (after.has(name) ? ["lost", `${called(name)} lost`] : ["found", `${called(name)} found`]));
}

// One that was seen once and is not any more. As before while nothing tells.
function isGone(name) {
  const body = entity(name);
  if (!body || trackerSilent()) return before.lost.has(name);
  return body.age_s < NEVER_S && body.age_s + shownEstimateAge() > store.scene.lost_after_s;
}

// Of each grave alarm that stands: what it is about and its words. Those of the page itself are among them.
function graveAlarms() {
  const { ended, alarms = [] } = store.s, own = ownAlarms().map(({ about, title }) => [about, title]);
  const told = runOver() ? [] : alarms.filter(({ grave }) => grave).map(({ about, text }) => [about, text]);
  return [...(ended && ended.severity !== "INFO" ? [["ended", ended.text]] : []), ...own, ...told];
}

// The words of grave alarms that began now. One stays the same while its figures change, and while it is away for a moment.
function begun() {
  const at = performance.now(), all = new Map(graveAlarms());
  for (const [about, ended] of known) {
    if (ended !== null && at - ended > BREAK_MS) known.delete(about);
    else if (ended === null && !all.has(about)) known.set(about, at);
  }
  const fresh = [...all].filter(([about]) => !known.has(about));
  for (const about of all.keys()) known.set(about, null);
  return fresh.map(([, words]) => words);
}

// The newest is said at once, but after a stop that is being said: only another stop cuts it off.
function announce(cues) {
  const audible = cues.filter(([cue]) => !muted || cue === "stop"), stop = audible.some(([cue]) => cue === "stop");
  if (!audible.length) return;
  // A browser gives neither sound nor shake before the first click or key on the page.
  // The last one's shakes replace those of the others.
  if (navigator.userActivation?.hasBeenActive) [...new Set(audible.map(([cue]) => cue))].reverse().forEach((cue) => signal(CUES[cue]));
  if (!("speechSynthesis" in window)) return;
  if (stop || performance.now() > stopUntil) speechSynthesis.cancel();
  if (stop) stopUntil = performance.now() + SAYING_MS;
  for (const [, words] of audible) speechSynthesis.speak(new SpeechSynthesisUtterance(words));
}

function signal({ hertz, shakes }) {
  if (shakes.length) navigator.vibrate?.(shakes);
  try {
    context ??= new AudioContext();
    const tone = context.createOscillator(), volume = context.createGain();
    tone.frequency.value = hertz;
    volume.gain.value = 0.15;
    tone.connect(volume).connect(context.destination);
    tone.start();
    tone.stop(context.currentTime + 0.18);
  } catch { /* no sound device */ }
}
