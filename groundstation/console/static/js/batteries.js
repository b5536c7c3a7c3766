// What the batteries hold and how long they are good for, as the console's process works it out for all pages.

import { droneNames, store } from "./store.js";

const RANKS = ["empty", "unknown", "low", "good"];
const LEVELS = { empty: "bad", unknown: "warn", low: "warn", good: "good" };

// Until it lands its drone by itself, in the same words in the bar and on the cards; "" where nobody knows.
export function lastsWords({ battery, good_for: time, battery_min: limit }) {
  const least = `${(100 * limit).toFixed(0)} %`;
  return time && (battery < limit ? `below ${least}` : `${time} of flight`);
}

const share = ({ battery }) => (battery === null ? "unknown" : `${(100 * battery).toFixed(0)} %`);

// The battery that is nearest to its end, of the drones that were heard: {name, words, level, lasts}; null where none was.
export function worstBattery() {
  const all = droneNames().map((name) => [name, store.s.vehicles?.[name]]).filter(([, status]) => status);
  if (!all.length) return null;
  const [[name, status]] = all.sort(([, a], [, b]) => RANKS.indexOf(a.charge) - RANKS.indexOf(b.charge)
    || (a.minutes ?? Infinity) - (b.minutes ?? Infinity) || a.battery - b.battery);
  return { name, words: share(status), level: LEVELS[status.charge], lasts: lastsWords(status) };
}

const SCARCE = 0.15; // above its limit; else it is the time that is short

// [words, class] of a card.
export function batteryWords(status) {
  const standing = ["LANDED", "CUT"].includes(status.mode), scarce = status.battery < status.battery_min + SCARCE;
  const more = status.charge === "empty" && standing ? " charge!" : scarce && status.charge !== "unknown" ? " low" : "";
  return [`${share(status)}${more}`, { empty: "empty", low: "low" }[status.charge] ?? ""];
}
