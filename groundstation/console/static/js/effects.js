// What a start or a stop would do now.

import { aloft, lostTarget, modeNow, modes, up, waits } from "./glance.js";
import { droneNames, store, trackerSilent } from "./store.js";

// Why a start would be refused or do nothing now; "" if it would not. Stops are never withheld while a run goes on.
export function refusalOf(verb, names = droneNames()) {
  const all = modes(names);
  if (modes().includes("TAKING_OFF")) return "one is taking off";
  if (verb === "TAKEOFF") return takeOffRefusal(names.map((name) => [name, store.s.vehicles?.[name]]).filter(([, status]) => ["LANDED", "CUT"].includes(status?.mode)));
  if (!aloft()) return "nobody flies";
  if (trackerSilent()) return "tracker silent";
  const resumes = waiting(names).length;
  if (verb === "RESUME") return resumes ? "" : "nobody waits for it";
  if (resumes) return "press RESUME";
  return all.includes("HOVER") ? "" : all.includes("TRACK") ? (lostTarget() ? "searching already" : "tracking already") : "nobody hovers";
}

function takeOffRefusal(standing) {
  if (!standing.length) return "nobody on the floor";
  if (standing.every(([, status]) => status.battery === null)) return "battery unknown";
  return standing.every(([, status]) => status.battery < status.battery_min) ? "battery too low" : "";
}

// After an order or a failsafe a drone hovers until RESUME; after its take-off until TRACK. RESUME lets both go on.
export function waiting(names = droneNames()) {
  const waitsNow = (status) => status?.mode === "HOLD" || (status?.mode === "HOVER" && waits(status.detail));
  return names.filter((name) => waitsNow(store.s.vehicles?.[name]));
}

export const SHORT = 8; // letters of a name that has room on a button

// Who does what, in the few words that a button has room for: "drone_1 hovers", "2 hover".
function does(names, one, many) {
  if (!names.length) return "";
  return names.length > 1 ? `${names.length} ${many}` : `${names[0].length > SHORT ? "1" : names[0]} ${one}`;
}

// What a stop of these drones would do now, to whom, and to whom not; "" where it does to all what it is for.
export function effectOf(verb, names = droneNames()) {
  const flying = up(names), down = names.filter((name) => modeNow(name) && !flying.includes(name));
  if (!modes(names).length) return "";
  if (!flying.length) return names.length > 1 ? "nobody flies" : "it stands";
  if (verb === "CUT_MOTORS") return flying.length > 1 ? "" : "press 1 s: it falls";
  if (names.length === 1) return effectOnOne(verb, names);
  const idle = isIdle(verb, names), held = holding(names), bound = flying.filter((name) => !held.includes(name));
  if (verb === "LAND") return idle ? "landing already" : landing(flying, down);
  if (bound.length === names.length) return "all land anyway";
  if (held.length === names.length) return idle ? "hovering already" : "";
  const already = idle ? " already" : "";
  return [does(held, `hovers${already}`, `hover${already}`), does(bound, "lands anyway", "land anyway"), does(down, "stands", "stand")].filter(Boolean).join(";\n");
}

function effectOnOne(verb, names) {
  if (verb === "LAND") return isIdle(verb, names) ? "it lands" : "";
  return !holding(names).length ? "lands anyway" : isIdle(verb, names) ? "it hovers" : "";
}

// What LAND would do to who flies, where not all of the team follow it anew; "" where they do.
function landing(flying, down) {
  const anew = flying.filter((name) => modeNow(name) !== "LANDING"), already = flying.filter((name) => !anew.includes(name));
  return down.length || already.length ? [does(anew, "lands", "land where they are"), does(already, "lands already", "land already")].filter(Boolean).join(";\n") : "";
}

// Whether a stop would change nothing now.
export function isIdle(verb, names = droneNames()) {
  if (!modes(names).length) return false;
  const left = { HOLD: "HOLD", LAND: "LANDING" }[verb], moved = verb === "HOLD" ? holding(names) : up(names);
  return moved.every((name) => modeNow(name) === left);
}

// Whom HOLD holds: neither a landing nor what leads to one by itself is stopped by it.
export const holding = (names = droneNames()) => up(names).filter((name) => modeNow(name) !== "LANDING" && (store.s.vehicles[name].lands_in_s ?? null) === null);

export const STOPS = new Set(["HOLD", "LAND", "CUT_MOTORS"]);
