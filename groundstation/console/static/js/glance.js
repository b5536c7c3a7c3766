// What the bar says of the whole team, worked out of the newest of everything.

import { ageS, droneNames, estimateAge, isTarget, entities, runOver, store } from "./store.js";

const HEARD_S = 1; // as in groundstation/monitor/alarms.py
const RECORDING_SILENT_S = 3;
const LEAST_DRAIN = 0.02, LEAST_MIN = 0.5;
const ALOFT = new Set(["TAKING_OFF", "HOVER", "HOLD", "TRACK", "LANDING"]);
export const STAGES = ["pre-flight", "take-off", "track", "land", "over"];

const statuses = () => droneNames().map((name) => store.s.vehicles?.[name]).filter(Boolean);
// Its mode; HOVER as well while a failsafe keeps it from following the plan in TRACK.
export const modeOf = (status) => (status?.braked ? "HOVER" : status?.mode);
export const modes = (names = droneNames()) => names.map((name) => store.s.vehicles?.[name]?.mode).filter(Boolean);
export const aloft = () => modes().filter((mode) => ALOFT.has(mode)).length;
export const targetAgeS = () => Math.min(...entities().filter(({ name }) => isTarget(name)).map((body) => body.age_s + estimateAge()), Infinity);

// The most careful thing that any drone does is what the team does; [words, level, how many of them].
export function teamMode() {
  const all = statuses().map(modeOf), lost = statuses().filter((status) => ageS(status.at) > HEARD_S).length;
  if (runOver()) return ["RUN OVER", "calm"];
  if (lost) return [`${lost} NOT HEARD`, "bad"];
  if (all.includes("CUT")) return ["CUT", "bad"];
  if (all.includes("LANDING")) return ["LANDING", "warn", share(all, "LANDING")];
  if (all.includes("TAKING_OFF")) return ["TAKING OFF", "warn", share(all, "TAKING_OFF")];
  if (all.includes("HOLD")) return ["HOLD", "warn"];
  if (all.includes("TRACK")) return targetAgeS() > (store.scene?.lost_after_s ?? 3) ? ["SEARCH", "warn"] : ["TRACK", "good"];
  if (all.includes("HOVER")) return ["HOVER", "warn"];
  return all.length ? ["ON GROUND", "calm"] : ["–", "calm"];
}

// " 1/2" where not all of them do it.
function share(all, mode) {
  const count = all.filter((one) => one === mode).length;
  return count < all.length ? ` ${count}/${all.length}` : "";
}

export function stage() {
  const all = modes();
  if (runOver()) return "over";
  if (all.includes("LANDING")) return "land";
  if (all.includes("TAKING_OFF") || (all.includes("HOVER") && !all.includes("TRACK"))) return "take-off";
  return aloft() ? "track" : store.s.flight?.flown ? "land" : "pre-flight";
}

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

const modeNow = (name) => store.s.vehicles?.[name]?.mode;
const willLand = (name) => ALOFT.has(modeNow(name)) && modeNow(name) !== "LANDING";

// How long a drone's battery lasts, and until what; "" where nobody knows, and while it lands already.
export function lastsWords(name) {
  const left = modeNow(name) === "LANDING" ? null : minutesLeft(name);
  return left ? `${willLand(name) ? "lands in" : "flies"} ${minuteWords(left)}` : "";
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
const leastBattery = (name) => sceneOf(name)?.battery_min ?? 0.15;

// Thresholds of the bar and of the cards: docs/explanation/console.md#thresholds.
export function batteryLevel(name, value) {
  const limit = leastBattery(name);
  return value < limit + 0.05 ? "bad" : value < limit + 0.15 ? "warn" : "good";
}

// NaN once the run is over: nothing gets older any more.
export const oldestS = () => runOver() ? NaN : Math.max(estimateAge(), ...droneNames().map((name) => ageS(store.s.vehicles?.[name]?.at)));

// Nobody is heard of once the run is over: then what counts is how long the recorder was silent before the others were.
function recorderSilentS(recorder) {
  if (!runOver()) return ageS(recorder.at);
  return (Math.max(...Object.values(store.s.processes).map((one) => one.at)) - recorder.at) / 1000;
}

export function recording() {
  const recorder = store.s.processes?.recorder;
  if (!recorder) return ["none", "warn"];
  if (recorderSilentS(recorder) > RECORDING_SILENT_S) return ["STOPPED", "bad"];
  if (runOver()) return ["ended", "calm"];
  return recorder.state === "READY" ? ["on", "good"] : [recorder.state.toLowerCase(), "warn"];
}

// Why a start would be refused now; "" if it would not. Stops are never withheld while a run goes on.
export function refusalOf(verb, names = droneNames()) {
  const all = modes(names);
  if (modes().includes("TAKING_OFF")) return "a drone is taking off";
  if (verb === "TAKEOFF") return all.some((mode) => mode === "LANDED" || mode === "CUT") ? "" : "no drone stands on the floor";
  if (!aloft()) return "no drone is in the air";
  if (verb === "HOLD" || all.some((mode) => mode === "HOVER" || mode === "HOLD")) return "";
  return all.includes("TRACK") ? "the team tracks already" : "no drone hovers or holds";
}

export const STOPS = new Set(["HOLD", "LAND", "CUT_MOTORS"]);
const UNHEARD_S = 0.8, FORGOTTEN_S = 30;

// The newest stop, if a drone has not answered it: an alarm, wherever it was given.
export function unheardStop() {
  const order = runOver() ? null : (store.s.orders ?? []).find(({ verb }) => STOPS.has(verb));
  const silent = (order?.rows ?? []).filter(({ stage }) => !stage).map(({ name }) => name), age = ageS(order?.given_ms);
  return silent.length && age > UNHEARD_S && age < FORGOTTEN_S ? { verb: order.verb.replace("_", " "), names: silent.join(", ") } : null;
}
