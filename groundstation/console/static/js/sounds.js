// What is worth hearing and feeling: stops, alarms, a battery that runs low, a lost target. Muting silences all but stops.

import { byId } from "./dom.js";
import { targetAgeS } from "./glance.js";
import { now, replaying, store } from "./store.js";

const KEY = "skein-muted", NEW_MS = 3000;
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
const heard = new Set();
let muted = false, before = { charges: {}, lost: false, alarm: "" }, context = null;

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
  for (const order of store.s.orders ?? []) {
    if (!STOPS[order.verb] || heard.has(order.id)) continue;
    heard.add(order.id);
    if (now() - order.given_ms < NEW_MS) say("stop", STOPS[order.verb]);
  }
  const age = targetAgeS();
  const after = {
    charges: Object.fromEntries(Object.entries(store.s.vehicles ?? {}).map(([name, { charge }]) => [name, charge])),
    lost: Number.isFinite(age) && age > store.scene.lost_after_s,
    alarm: (store.s.alarms ?? []).find(({ grave }) => grave)?.text ?? "",
  };
  for (const [name, charge] of Object.entries(after.charges)) if (SCARCE.has(charge) && charge !== before.charges[name]) say("battery", `battery ${name} ${charge}`);
  if (after.lost !== before.lost) say(after.lost ? "lost" : "found", after.lost ? "target lost" : "target found");
  if (after.alarm && after.alarm !== before.alarm) say("alarm", after.alarm);
  before = after;
}

function say(cue, words) {
  if (muted && cue !== "stop") return;
  // A browser gives neither sound nor shake before the first click or key on the page.
  if (navigator.userActivation?.hasBeenActive) signal(CUES[cue]);
  if (!("speechSynthesis" in window)) return;
  speechSynthesis.cancel();
  speechSynthesis.speak(new SpeechSynthesisUtterance(words));
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
