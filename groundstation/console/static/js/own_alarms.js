// Alarms that only a page can raise: that it hears nothing, or that a stop is not answered; and those of them that are over.

import { sinceMs } from "./clock.js";
import { joined, seconds } from "./dom.js";
import { STOPS } from "./effects.js";
import { failures } from "./guard.js";
import { mayGive, ownOrders } from "./own_orders.js";
import { ageS, consoleSilent, estimateAge, frameAgeS, linkSlow, now, replaying, runOver, silentS, slowForS, store } from "./store.js";

const FEW = 3; // faults that are named
const KEPT = 50; // this and the next as groundstation/console/alarm_log.py has them
export const BREAK_MS = 2000;
const UNHEARD_S = 0.8, FORGOTTEN_S = 30;
// A slow link asks for an act when the newest frame is older than the first, and frames have been late for the second:
// a page that stood still gets old ones for a moment.
const SLOW_S = 2, SLOW_FOR_S = 1;
// Modes in which a drone that refuses a stop does what was asked, or more.
const DOES_MORE = { HOLD: ["HOLD", "LANDING", "LANDED", "CUT"], LAND: ["LANDING", "LANDED", "CUT"], CUT_MOTORS: ["LANDED", "CUT"] };
const NOT_GIVEN = { unsent: "NOT SENT", dropped: "NOT SENT", refused: "REFUSED" };
const done = new Set(); // refusals by drones that did more when they refused; they may have gone up again
let episodes = [], keptFor = "";

export const slowWords = () => `SLOW LINK: what you see is ${seconds(frameAgeS())} old`;

// [{kind, about, title, more, old, shell}]: about stays the same while figures change; old: whether all that the page shows
// is; shell: whether only a shell helps.
export function ownAlarms() {
  if (runOver()) return [];
  const alarms = [], age = estimateAge(), old = Number.isFinite(age) ? `What you see is ${seconds(age)} old.` : "";
  if (!store.connected) alarms.push({ kind: "link", about: "link", title: "NO CONNECTION TO THE CONSOLE", more: [store.reason && `${store.reason}.`, old].filter(Boolean).join(" "), old: true, shell: true });
  else if (linkSlow() && frameAgeS() > SLOW_S && slowForS() > SLOW_FOR_S) alarms.push({ kind: "slow", about: "slow link", title: slowWords(), more: "To do: bring this device nearer, or watch on another. Stops go out at once.", old: true });
  else if (consoleSilent()) alarms.push({ kind: "silent", about: "silent", title: `CONSOLE SILENT for ${seconds(silentS())}`, more: old, old: true, shell: true });
  const faults = failures();
  if (faults.length) alarms.push({ kind: "fault", about: "page fault", title: `PAGE FAULT: ${faults.length > FEW ? `${faults.length} parts` : joined(faults)} may show what was`, more: "To do: reload this page, or watch on another. Stops go out all the same." });
  const stop = store.connected ? failedStop() : null;
  if (stop) alarms.push({ kind: "unheard", about: `unheard ${stop.id}`, title: stopWords(stop), more: "To do: press again. If a drone flies on: groundstation land in a shell, or its own remote control." });
  return alarms;
}

// All stops that concern this run, wherever they were given, the newest first.
function stops() {
  const own = ownOrders().filter(({ run, verb }) => run === store.run && mayGive(verb));
  return [...own, ...(store.s.orders ?? [])].filter(({ verb }) => STOPS.has(verb)).sort((a, b) => b.given_ms - a.given_ms);
}

// The newest stop that somebody has not answered, or refused and flies on, to whom no newer one was given.
function failedStop() {
  const renewed = new Set();
  for (const { id, ref, verb, state, rows, given_ms, since } of stops()) {
    // What became of a page's own is known later than it was given, much later on a page that stood still.
    const age = ageS(given_ms), known = since ? sinceMs(since) / 1000 : age;
    const open = rows.filter(({ name }) => !renewed.has(name)), silent = open.filter(({ stage }) => !stage), refused = open.filter((row) => isRefused(id, verb, row));
    if (silent.length + refused.length && age > UNHEARD_S && known < FORGOTTEN_S) return { id: ref || id, verb: verb.replace("_", " "), silent, refused, state };
    rows.forEach(({ name }) => renewed.add(name));
  }
  return null;
}

function isRefused(id, verb, { name, stage }) {
  const key = `${id} ${name}`;
  if (stage === "REFUSED" && DOES_MORE[verb].includes(store.s.vehicles?.[name]?.mode)) done.add(key);
  return stage === "REFUSED" && !done.has(key);
}

const namesOf = (rows) => rows.map(({ name }) => name).join(", ");

function stopWords({ verb, silent, refused, state }) {
  const fault = NOT_GIVEN[state], words = [];
  if (silent.length) words.push(fault ? `${verb} ${fault}: not given to ${namesOf(silent)}` : `${verb} NOT CONFIRMED: no answer from ${namesOf(silent)}`);
  if (refused.length) words.push(`${verb} REFUSED by ${namesOf(refused)}: ${refused[0].reason}`);
  return words.join("; ");
}

const storeKey = () => `skein-own-alarms ${store.run}`;

// They outlive a reload of the page, as those of the console's process do.
function recall() {
  keptFor = store.run;
  try { episodes = JSON.parse(sessionStorage.getItem(storeKey())) ?? []; } catch { episodes = []; }
}

function keep() {
  try { sessionStorage.setItem(storeKey(), JSON.stringify(episodes)); } catch { /* they last until the page goes */ }
}

// Begins, carries on and ends what is logged, from all that stand now; before the first seed nobody knows what time it is.
export function noteOwnAlarms(alarms) {
  if (replaying() || !store.scene) return;
  if (keptFor !== store.run) recall();
  const at = now(), before = JSON.stringify(episodes.map(({ ended }) => ended));
  for (const episode of episodes) if (episode.ended === null && !alarms.some(({ about }) => about === episode.about)) episode.ended = at;
  for (const { about, title } of alarms) {
    const known = episodes.find((episode) => episode.about === about && (episode.ended === null || at - episode.ended < BREAK_MS));
    if (known) Object.assign(known, { text: title, ended: null });
    else episodes = [{ about, text: title, asks: true, began: at, ended: null }, ...episodes].slice(0, KEPT);
  }
  if (JSON.stringify(episodes.map(({ ended }) => ended)) !== before) keep();
}

export const ownPast = () => episodes.filter(({ ended }) => ended !== null);
