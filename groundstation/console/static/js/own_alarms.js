// Alarms that only a page can raise: that it hears nothing, or that a stop is not answered.

import { seconds } from "./dom.js";
import { unheardStop } from "./effects.js";
import { consoleSilent, estimateAge, silentS, store } from "./store.js";

// [{kind, about, title, more, shell}]: about stays the same while figures change; shell: whether only a shell helps.
export function ownAlarms() {
  if (store.s.ended) return [];
  const alarms = [], age = estimateAge(), old = Number.isFinite(age) ? `What you see is ${seconds(age)} old.` : "";
  if (!store.connected) alarms.push({ kind: "link", about: "link", title: "NO CONNECTION TO THE CONSOLE", more: [store.reason && `${store.reason}.`, old].filter(Boolean).join(" "), shell: true });
  else if (consoleSilent()) alarms.push({ kind: "silent", about: "silent", title: `CONSOLE SILENT for ${seconds(silentS())}`, more: old, shell: true });
  const stop = store.connected ? unheardStop() : null;
  if (stop) alarms.push({ kind: "unheard", about: `unheard ${stop.id}`, title: `${stop.verb} NOT CONFIRMED: no answer from ${stop.names}`, more: "To do: press again. What flies on: groundstation land in a shell, or its own remote control." });
  return alarms;
}
