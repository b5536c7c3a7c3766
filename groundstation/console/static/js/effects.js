// The effect of a start or a stop now, or why a start has none: in the few words that a button has room for.

import { aloft, isDown, isLost, isUnheard, lostTarget, modeNow, modeOf, modes, standing, unsure, up, waits } from "./glance.js";
import { wasForbidden } from "./preflight.js";
import { droneNames, store, trackerSilent } from "./store.js";

// Why a start would be refused or do nothing now; "" if it would not. Stops are never withheld while a run goes on.
export function refusalOf(verb, names = droneNames()) {
  const all = modes(names);
  const risen = up(names).some((name) => modeNow(name) !== "TAKING_OFF");
  if (modes().includes("TAKING_OFF") && (verb === "TAKEOFF" || !risen)) return "one rises";
  if (verb === "TAKEOFF") return takeOffRefusal(names);
  if (!aloft()) return unsure().length ? "not heard" : "nobody flies";
  if (trackerSilent()) return "no tracker";
  const resumes = waiting(names).length;
  if (verb === "RESUME") return resumes ? "" : "none on hold";
  if (resumes) return "press RESUME instead";
  if (all.includes("HOVER")) return "";
  if (up(names).every(isBound)) return names.length > 1 ? "they land" : "it lands";
  return all.includes("TRACK") ? (lostTarget() ? "searching already" : "tracking already") : "none hovers";
}

function takeOffRefusal(names) {
  const flying = up(names).length, stand = standing(names), batteries = stand.map((name) => store.s.vehicles[name]), down = stand.filter(isDown);
  if (stand.length && stand.every(isUnheard)) return "not heard";
  if (down.length && aloft()) return `check ${down.length > 1 ? howMany(down) : nameOf(down[0])}`;
  if (!batteries.length) return flying === names.length ? "flying already" : flying ? "none stands" : "not heard yet";
  if (batteries.every(({ battery }) => battery === null)) return "battery unknown";
  return batteries.every(({ battery, battery_min: least }) => battery < least) ? "low battery" : "";
}

// After an order or a failsafe a drone hovers until RESUME; after its take-off until TRACK. RESUME lets both go on.
export function waiting(names = droneNames()) {
  const waitsNow = (status) => status?.mode === "HOLD" || (status?.mode === "HOVER" && waits(status.detail));
  return names.filter((name) => waitsNow(store.s.vehicles?.[name]));
}

const SHORT = 8; // letters of a name that has room on a button
const nameOf = (name) => (name.length > SHORT ? "1" : name);

// "one", "both", "all 4", or "2" of more.
export const howMany = ({ length }) => (length === 1 ? "one" : length < droneNames().length ? length : length > 2 ? `all ${length}` : "both");

// Drones with their action: "drone_1 hovers", "both hover", "all 4 hover", "2 hover".
function does(names, one, many) {
  if (names.length < 2) return names.length ? `${nameOf(names[0])} ${one}` : "";
  return `${howMany(names)} ${many}`;
}

// A button has room for two deeds; of more, the first is named.
function told(parts, others = "others land") {
  const all = parts.filter(Boolean);
  return (all.length > 2 ? [all[0], others] : all).join(";\n");
}

// The drones that would follow TRACK.
export const ready = () => droneNames().filter((name) => modeNow(name) === "HOVER");

// Whether it may stay on the floor although it is ordered to take off.
export const mayFail = (name) => isDown(name) || wasForbidden(name);

// The effect that a start of the team would have now, with the drones concerned.
export function startEffect(verb) {
  if (verb === "TAKEOFF") return standing().some(mayFail) ? does(standing(), "rises, if able", "rise, if able") : does(standing(), "rises, hovers", "rise, one by one");
  const who = verb === "RESUME" ? waiting() : ready();
  const how = who.some(isBound) ? ", if able" : verb === "RESUME" ? " again" : "";
  return does(who, ...(lostTarget() ? ["searches", "search"] : ["tracks", "track"]).map((word) => `${word}${how}`));
}

// The effect that a stop of the team would have now, for each drone; "" without telemetry from any drone.
export function effectOf(verb) {
  const flying = up();
  if (!modes().length) return "";
  if (!flying.length) return unsure().length ? "if one flies" : "nobody flies";
  if (flying.some(isUnheard)) return unheard(verb, flying);
  if (verb === "CUT_MOTORS") return `press 1 s:\n${does(flying, "falls", "fall")}`;
  return verb === "LAND" ? landing(flying) : hover(flying);
}

// Drones that a stop may not reach: it is sent all the same.
function unheard(verb, flying) {
  const deaf = flying.filter(isUnheard), heard = flying.filter((name) => !isUnheard(name));
  const word = verb === "CUT_MOTORS" ? "fall" : verb === "HOLD" && holding(heard.length ? heard : deaf).length ? "hover" : "land";
  if (!heard.length) return does(deaf, `${word}s\nif it hears`, `${word}\nif they hear`);
  const [one, many] = word === "hover" && trackerSilent() ? [",\nthen lands", ",\nthen land"] : ["", ""];
  return told([does(heard, `${word}s${one}`, `${word}${many}`), does(deaf, "if it hears", "if they hear")]);
}

// The effect that a stop of one drone would have now.
export function effectOnOne(verb, name) {
  if (!modeNow(name)) return "";
  if (unsure([name]).length) return "if it flies";
  if (!up([name]).length) return isDown(name) ? "no use: down" : "no use: stands";
  if (isUnheard(name)) return "if it hears";
  if (verb === "LAND") return isIdle(verb, [name]) ? "lands already" : "lands here";
  if (!holding([name]).length) return "lands anyway";
  return isLost(name) ? "lands if unseen" : isIdle(verb, [name]) ? "hovers already" : modeOf(store.s.vehicles[name]) === "HOVER" ? "until RESUME" : "hovers here";
}

// A lost drone hovers as well, until a failsafe lands it.
function hover(flying) {
  const held = holding(), lost = held.filter(isLost), seen = held.filter((name) => !isLost(name)), bound = flying.filter((name) => !held.includes(name));
  if (bound.length === droneNames().length) return does(bound, "lands anyway", "land anyway");
  const yet = isIdle("HOLD") ? " already" : "";
  if (trackerSilent()) return told([does(held, `hovers${yet},\nthen lands`, `hover${yet},\nthen land`), does(bound, "lands anyway", "land anyway")]);
  const how = isIdle("HOLD") ? " already" : held.length === droneNames().length ? " in place" : "";
  if (!lost.length) return told([does(held, `hovers${how}`, `hover${how}`), does(bound, "lands anyway", "land anyway"), ...left()], "others land or stand");
  if (lost.length < flying.length) return told([does(seen, "hovers", "hover"), does(lost, "lands if unseen", "land if unseen"), does(bound, "lands anyway", "land anyway")]);
  return does(lost, "hovers; it lands\nif it stays unseen", "hover; they land\nif they stay unseen");
}

function left() {
  const down = standing().filter(isDown);
  return [does(down, "is down", "are down"), does(standing().filter((name) => !down.includes(name)), "stands", "stand")];
}

function landing(flying) {
  const anew = flying.filter((name) => modeNow(name) !== "LANDING"), already = flying.filter((name) => !anew.includes(name));
  return already.length ? told([does(anew, "lands", "land"), does(already, "lands already", "land already")]) : does(anew, "lands\nwhere it is", "land\nwhere they are");
}

// Whether a stop would change nothing now.
export function isIdle(verb, names = droneNames()) {
  if (!modes(names).length || unsure(names).length) return false;
  const left = { HOLD: "HOLD", LAND: "LANDING" }[verb], moved = verb === "HOLD" ? holding(names) : up(names);
  return moved.every((name) => modeNow(name) === left && !isUnheard(name));
}

// Whether a failsafe is about to land it, whatever is ordered: whether its fault is over, only its driver knows.
const isBound = (name) => (store.s.vehicles[name].lands_in_s ?? null) !== null && !waits(store.s.vehicles[name].detail);
// The drones that HOLD holds: it stops neither a landing, an imminent failsafe landing nor that after ignored CUT MOTORS.
const holding = (names = droneNames()) => up(names).filter((name) => !["LANDING", "CUT"].includes(modeNow(name)) && !isBound(name));

export const STOPS = new Set(["HOLD", "LAND", "CUT_MOTORS"]);
