// What the batteries hold, and how long they last.

import { ALOFT, modeNow } from "./glance.js";
import { droneNames, store } from "./store.js";

const LEAST_DRAIN = 0.02, LEAST_MIN = 0.5, LOW_MIN = 3;

// When each drone that is aloft was first heard aloft, and its battery then.
const tookOff = new Map();

function takenOff(name, status) {
  if (!ALOFT.has(status.mode)) { tookOff.delete(name); return null; }
  const first = tookOff.get(name);
  if (first && status.at >= first.at && status.battery <= first.battery) return first;
  tookOff.set(name, { at: status.at, battery: status.battery });
  return null;
}

// Minutes until a battery is at the level that lands its drone: [minutes, whether by the mean drain of this flight or by
// what its kind usually does]; null: nobody knows.
export function minutesLeft(name) {
  const status = store.s.vehicles?.[name], usual = sceneOf(name)?.flight_time_s;
  if (!status || status.battery === null) return null;
  const left = Math.max(0, status.battery - leastBattery(name)), first = takenOff(name, status);
  const minutes = first ? (status.at - first.at) / 60_000 : 0, spent = first ? first.battery - status.battery : 0;
  if (minutes >= LEAST_MIN && spent >= LEAST_DRAIN) return [(left * minutes) / spent, true];
  return usual ? [(left * usual) / 60, false] : null;
}

// As measured "6 min", by what its kind usually does "~6 min".
const minuteWords = ([minutes, measured]) => (minutes < 1 ? "< 1 min" : `${measured ? "" : "~"}${Math.floor(minutes)} min`);

const willLand = (name) => ALOFT.has(modeNow(name)) && modeNow(name) !== "LANDING";

// How long a drone's battery lasts, and until what; "" where nobody knows. Whatever lands it sooner stands elsewhere.
export function lastsWords(name) {
  const left = minutesLeft(name), status = store.s.vehicles?.[name], lands = willLand(name) && status.lands_in_s === null;
  if (status?.mode === "LANDING") return "landing now";
  if (!left) return "";
  return `${lands ? "lands in" : ALOFT.has(status.mode) ? "battery for" : "flies"} ${minuteWords(left)}`;
}

// The same of the worst battery; of another drone that has to land sooner, if there is one.
export function teamLastsWords(worst) {
  const own = minutesLeft(worst), others = droneNames().filter(willLand).map(minutesLeft).filter(Boolean);
  const soonest = others.reduce((least, one) => (!least || one[0] < least[0] ? one : least), null);
  return soonest && (!own || soonest[0] < own[0]) ? `another: ${minuteWords(soonest)}` : lastsWords(worst);
}

// The least battery, and whose it is; an unknown one is worse than any unless that is to be charged. least: of those
// that are known. null where a drone was not heard yet.
export function worstBattery() {
  const all = droneNames().map((name) => [name, store.s.vehicles?.[name]?.battery]);
  if (!all.length || all.some(([, value]) => value === undefined)) return null;
  const known = all.filter(([, value]) => value !== null), unknown = all.find(([, value]) => value === null);
  const least = known.length ? known.reduce((worst, one) => (one[1] < worst[1] ? one : worst)) : null;
  const level = least ? batteryLevel(...least) : "good";
  if (unknown && level !== "bad") return { name: unknown[0], value: null, level: "warn", least };
  return { name: least[0], value: least[1], level, least };
}

const sceneOf = (name) => store.scene.drones.find((drone) => drone.name === name);
export const leastBattery = (name) => sceneOf(name)?.battery_min ?? 0.15;

// Thresholds of the bar and of the cards: docs/explanation/console.md#thresholds.
export function batteryLevel(name, value) {
  const limit = leastBattery(name), minutes = willLand(name) ? minutesLeft(name)?.[0] ?? Infinity : Infinity;
  return value < limit + 0.05 || minutes < 1 ? "bad" : value < limit + 0.15 || minutes < LOW_MIN ? "warn" : "good";
}
