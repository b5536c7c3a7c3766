// What a start or a stop would do now.

import { leastBattery } from "./batteries.js";
import { ALOFT, aloft, modeNow, modes } from "./glance.js";
import { ageS, droneNames, runOver, store, trackerSilent } from "./store.js";

// Why a start would be refused or do nothing now; "" if it would not. Stops are never withheld while a run goes on.
export function refusalOf(verb, names = droneNames()) {
  const all = modes(names);
  if (modes().includes("TAKING_OFF")) return "one is taking off";
  if (verb === "TAKEOFF") return takeOffRefusal(names.map((name) => [name, store.s.vehicles?.[name]]).filter(([, status]) => ["LANDED", "CUT"].includes(status?.mode)));
  if (!aloft()) return "nobody flies";
  if (trackerSilent()) return "tracker silent";
  const resumes = needResume(names);
  if (verb === "RESUME") return resumes ? "" : "nobody waits for it";
  if (resumes) return "press RESUME";
  return all.includes("HOVER") ? "" : all.includes("TRACK") ? "under way" : "nobody hovers";
}

function takeOffRefusal(standing) {
  if (!standing.length) return "nobody on the floor";
  if (standing.every(([, status]) => status.battery === null)) return "battery unknown";
  return standing.every(([name, status]) => status.battery < leastBattery(name)) ? "battery too low" : "";
}

// After an order or a failsafe a drone hovers until RESUME; after its take-off until TRACK. RESUME lets both go on.
function needResume(names) {
  return names.map((name) => store.s.vehicles?.[name]).some((status) => status?.mode === "HOLD" || (status?.mode === "HOVER" && status.detail.includes("RESUME")));
}

const SHORT = 8; // letters of a name that has room on a button

// What a stop of these drones would do now, where that is not what it is for; "" where it is.
export function effectOf(verb, names = droneNames()) {
  const up = names.filter((name) => ALOFT.has(modeNow(name)));
  if (!modes(names).length) return "";
  if (!up.length) return names.length > 1 ? "nobody flies" : "it stands";
  if (verb === "LAND") return isIdle(verb, names) ? "landing already" : "";
  if (verb === "CUT_MOTORS") return "";
  const bound = up.filter((name) => !holding([name]).length);
  if (bound.length === up.length) return "lands anyway";
  if (bound.length) return bound.length > 1 ? `${bound.length} land anyway` : `${bound[0].length > SHORT ? "1" : bound[0]} lands anyway`;
  return isIdle(verb, names) ? "hold already" : "";
}

// Whether a stop would change nothing now.
export function isIdle(verb, names = droneNames()) {
  if (!modes(names).length) return false;
  const left = { HOLD: "HOLD", LAND: "LANDING" }[verb], moved = verb === "HOLD" ? holding(names) : names.filter((name) => ALOFT.has(modeNow(name)));
  return moved.every((name) => modeNow(name) === left);
}

// Whom HOLD holds: neither a landing nor what leads to one by itself is stopped by it.
export const holding = (names = droneNames()) => names.filter((name) => ALOFT.has(modeNow(name)) && modeNow(name) !== "LANDING" && (store.s.vehicles[name].lands_in_s ?? null) === null);

export const STOPS = new Set(["HOLD", "LAND", "CUT_MOTORS"]);
const UNHEARD_S = 0.8, FORGOTTEN_S = 30;

// The newest stop, if a drone has not answered it: an alarm, wherever it was given.
export function unheardStop() {
  const order = runOver() ? null : (store.s.orders ?? []).find(({ verb }) => STOPS.has(verb));
  const silent = (order?.rows ?? []).filter(({ stage }) => !stage).map(({ name }) => name), age = ageS(order?.given_ms);
  return silent.length && age > UNHEARD_S && age < FORGOTTEN_S ? { verb: order.verb.replace("_", " "), names: silent.join(", ") } : null;
}
