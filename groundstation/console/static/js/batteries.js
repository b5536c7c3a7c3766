// What the batteries hold and how long they are good for, as the console's process works it out for all pages.

import { up } from "./glance.js";
import { droneNames, store } from "./store.js";

const RANKS = ["empty", "unknown", "low", "good"];
const LEVELS = { empty: "bad", unknown: "warn", low: "warn", good: "good" };

// Until it lands its drone by itself, in the same words in the bar and on the cards; "" where nobody knows.
export function lastsWords({ battery, good_for: time, battery_min: limit }) {
  return time && (battery < limit ? "enough to land" : `${time} of flight`);
}

const share = ({ battery }) => (battery === null ? "unknown" : `${(100 * battery).toFixed(0)} %`);

// The battery that is nearest to its end, of the drones that were heard, and fly if any does: {name, words, level, title};
// null where none was.
export function worstBattery() {
  const flying = up(), all = (flying.length ? flying : droneNames()).map((name) => [name, store.s.vehicles?.[name]]).filter(([, status]) => status);
  if (!all.length) return null;
  const [[name, status]] = all.sort(([, a], [, b]) => RANKS.indexOf(a.charge) - RANKS.indexOf(b.charge)
    || (a.minutes ?? Infinity) - (b.minutes ?? Infinity) || a.battery - b.battery);
  const what = flying.length && flying.length < droneNames().length ? "worst in the air" : "worst battery", lasts = lastsWords(status);
  return { name, words: share(status), level: LEVELS[status.charge], title: lasts ? `${what}, ${lasts}` : what };
}

const SCARCE = 0.15; // above its limit; else it is the time that is short

// [words, class] of a card.
export function batteryWords(status) {
  const standing = ["LANDED", "CUT"].includes(status.mode), scarce = status.battery < status.battery_min + SCARCE;
  const more = status.charge === "empty" && standing ? " charge!" : scarce && status.charge !== "unknown" ? " low" : "";
  return [`${share(status)}${more}`, { empty: "empty", low: "low" }[status.charge] ?? ""];
}
