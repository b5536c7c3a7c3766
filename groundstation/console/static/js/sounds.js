// What is worth hearing: stops, alarms, a battery that runs low, a lost target. Muting silences all but stops.

import { worstBattery } from "./batteries.js";
import { byId } from "./dom.js";
import { targetAgeS } from "./glance.js";
import { now, replaying, store } from "./store.js";

const KEY = "skein-muted", NEW_MS = 3000;
const STOPS = { HOLD: "hold", LAND: "landing", CUT_MOTORS: "motors cut" };
const heard = new Set();
let muted = false, before = { battery: "good", lost: false, alarm: "" }, context = null;

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
    if (now() - order.given_ms < NEW_MS) say(STOPS[order.verb], true, 880);
  }
  const battery = worstBattery(), age = targetAgeS();
  const after = {
    battery: battery?.level ?? "good",
    lost: Number.isFinite(age) && age > store.scene.lost_after_s,
    alarm: (store.s.alarms ?? []).find(({ grave }) => grave)?.text ?? "",
  };
  if (after.battery !== before.battery && after.battery !== "good") say(`battery ${battery.name} ${after.battery === "bad" ? "empty" : "low"}`, false, 520);
  if (after.lost !== before.lost) say(after.lost ? "target lost" : "target found", false, after.lost ? 440 : 660);
  if (after.alarm && after.alarm !== before.alarm) say(after.alarm, false, 520);
  before = after;
}

function say(words, stop, hertz) {
  if (muted && !stop) return;
  beep(hertz);
  if (!("speechSynthesis" in window)) return;
  speechSynthesis.cancel();
  speechSynthesis.speak(new SpeechSynthesisUtterance(words));
}

// A browser gives no sound before the first click or key on the page.
function beep(hertz) {
  if (!navigator.userActivation?.hasBeenActive) return;
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
