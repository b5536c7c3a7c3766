// Alarms that only a page can raise: that it hears nothing, or that a stop is not answered; and those of them that are over.

import { seconds } from "./dom.js";
import { unheardStop } from "./effects.js";
import { consoleSilent, estimateAge, now, replaying, silentS, store } from "./store.js";

const KEPT = 50, BREAK_MS = 2000; // as groundstation/console/alarm_log.py has it
let episodes = [], keptFor = "";

// [{kind, about, title, more, shell}]: about stays the same while figures change; shell: whether only a shell helps.
export function ownAlarms() {
  if (store.s.ended) return [];
  const alarms = [], age = estimateAge(), old = Number.isFinite(age) ? `What you see is ${seconds(age)} old.` : "";
  if (!store.connected) alarms.push({ kind: "link", about: "link", title: "NO CONNECTION TO THE CONSOLE", more: [store.reason && `${store.reason}.`, old].filter(Boolean).join(" "), shell: true });
  else if (consoleSilent()) alarms.push({ kind: "silent", about: "silent", title: `CONSOLE SILENT for ${seconds(silentS())}`, more: old, shell: true });
  const stop = store.connected ? unheardStop() : null;
  if (stop) alarms.push({ kind: "unheard", about: `unheard ${stop.id}`, title: `${stop.verb} NOT CONFIRMED: no answer from ${stop.names}`, more: "To do: press again. If a drone flies on: groundstation land in a shell, or its own remote control." });
  return alarms;
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
