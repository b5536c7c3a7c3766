// The charge of the batteries and how long they last, as the console's process computes it for all pages.

import { aloft, modeNow, standing, up } from "./glance.js";
import { droneNames, store } from "./store.js";

const RANKS = ["empty", "unknown", "low", "good"];
const LEVELS = { empty: "bad", unknown: "warn", low: "warn", good: "good" };

// Until it lands its drone by itself, in the same words in the bar and on the cards; "" where nobody knows, of one that must
// be charged before it flies again, and while others fly of one that stands.
export function lastsWords(name) {
  const { battery, charge, good_for: time, battery_min: limit } = store.s.vehicles[name];
  if (standing([name]).length && (charge === "empty" || aloft())) return "";
  return time && (battery < limit ? "enough to land" : `good for ${time}`);
}

const share = ({ battery }) => (battery === null ? "unknown" : `${(100 * battery).toFixed(0)} %`);

// The batteries that count: of flying drones, if any; not of one that lands with a good battery while others fly on.
function counted() {
  const flying = up(), on = flying.filter((name) => modeNow(name) !== "LANDING" || store.s.vehicles[name].charge !== "good");
  return on.length ? on : flying.length ? flying : droneNames();
}

// The battery that is nearest to its end, of the drones that were heard: {name, words, level, title}; null where none was.
export function worstBattery() {
  const names = counted(), all = names.map((name) => [name, store.s.vehicles?.[name]]).filter(([, status]) => status);
  if (!all.length) return null;
  const [[name, status]] = all.sort(([, a], [, b]) => RANKS.indexOf(a.charge) - RANKS.indexOf(b.charge)
    || (a.minutes ?? Infinity) - (b.minutes ?? Infinity) || a.battery - b.battery);
  const least = names.length === droneNames().length ? "worst battery" : names.length < up().length ? "worst flying on" : "worst in the air", lasts = lastsWords(name);
  // Named although another one has no more charge: that one lasts longer.
  const what = lasts && all.some(([, other]) => other.battery <= status.battery && other.minutes > status.minutes + 1) ? "drains fastest" : least;
  return { name, words: share(status), level: LEVELS[status.charge], title: lasts ? `${what}, ${lasts}` : what };
}

const SCARCE = 0.15; // above its limit; else it is the time that is short

// [words, class] of a card.
export function batteryWords(name) {
  const status = store.s.vehicles[name], scarce = status.battery < status.battery_min + SCARCE;
  const more = status.charge === "empty" && standing([name]).length ? " charge!" : scarce && status.charge !== "unknown" ? " low" : "";
  return [`${share(status)}${more}`, { empty: "empty", low: "low" }[status.charge] ?? ""];
}
