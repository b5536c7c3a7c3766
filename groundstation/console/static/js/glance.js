// The bar's summary of the whole team, from the newest messages.

import { joined } from "./dom.js";
import { ageS, droneNames, estimateAge, isTarget, entity, NEVER_S, runOver, shownAgeS, shownEstimateAge, store, trackerSilent, unseenS } from "./store.js";

const HEARD_S = 1; // as in groundstation/monitor/alarms.py
const RECORDING_SILENT_S = 3;
const ALOFT = new Set(["TAKING_OFF", "HOVER", "HOLD", "TRACK", "LANDING"]);
const AIRBORNE = new Set(["TAKING_OFF", "FLYING", "HOVERING", "LANDING"]); // states of flight
export const STAGES = ["pre-flight", "take-off", "form", "track", "land", "over"];

const statuses = () => droneNames().map((name) => store.s.vehicles?.[name]).filter(Boolean);
// Its mode; HOVER as well while a failsafe keeps it from following the plan in TRACK.
export const modeOf = (status) => (status?.braked ? "HOVER" : status?.mode);
export const modeNow = (name) => store.s.vehicles?.[name]?.mode;
export const modes = (names = droneNames()) => names.map(modeNow).filter(Boolean);
// Whether its motors were cut, which its own state does not confirm: it falls, or has ignored that.
const mayHaveIgnoredCut = (name) => modeNow(name) === "CUT" && AIRBORNE.has(store.s.vehicles[name].flight);
// Of these drones those that fly.
export const up = (names = droneNames()) => names.filter((name) => ALOFT.has(modeNow(name)) || mayHaveIgnoredCut(name));
export const aloft = () => up().length;
// Of these drones those of which nobody knows whether they fly, as groundstation/monitor/endurance.py has it.
export const unsure = (names = droneNames()) => names.filter((name) => ["UNKNOWN", "LOST"].includes(store.s.vehicles?.[name]?.flight) && !["LANDED", "CUT"].includes(modeNow(name)) && !up([name]).length);
// Of these drones those that stand, and might take off.
export const standing = (names = droneNames()) => names.filter((name) => ["LANDED", "CUT"].includes(modeNow(name)) && !mayHaveIgnoredCut(name));

// Modes of the drones not on the ground, most careful first: [words, level, who does each if not all do the same].
export function teamMode() {
  const all = statuses().map(modeOf), silent = droneNames().filter(isUnheard);
  if (runOver()) return ["RUN OVER", "calm"];
  if (silent.length) return ["NOT HEARD", "bad", some(silent)];
  const soon = up().filter(landsIn), [first] = soon.map(landsIn).sort((a, b) => parseInt(a) - parseInt(b));
  if (soon.length && soon.length === aloft()) return [`LANDS IN ${first}`, "bad", some(soon)];
  const done = CAREFUL.filter(([mode]) => all.includes(mode));
  if (!done.length && unsure().length) return ["UNKNOWN", "warn", some(unsure())];
  if (!done.length) return [all.length ? "ON GROUND" : "–", "calm"];
  const named = done.map(([mode]) => modeWord(mode)), level = levelOf(...done[0]);
  if (soon.length) return [named[0], level, `${some(soon)} ${soon.length > 1 ? "land" : "lands"} in ${first}`];
  // Without room for all: the drones in the most careful mode, and the modes of the others.
  const together = named.join(" + "), careful = doing(done[0][0]);
  if (together.length > LETTERS) return [named[0], level, `${some(careful)}; ${all.length - careful.length > 1 ? "others" : "the other"} ${named.slice(1).join(", ")}`];
  return [together, level, done.map(([mode]) => some(doing(mode))).filter(Boolean).join(" + ")];
}

const CAREFUL = [["CUT", "bad"], ["LANDING", "warn"], ["TAKING_OFF", "warn"], ["HOLD", "warn"], ["HOVER", "warn"], ["TRACK", "good"]];

const levelOf = (mode, level) => (mode !== "TRACK" || modeWord(mode) === mode ? level : "warn");

// The word shown for a mode: a drone in TRACK searches while the target is lost.
export function modeWord(mode) {
  if (mode !== "TRACK") return mode === "CUT" ? "MOTORS OFF" : mode.replace("_", " ");
  return trackerSilent() ? "NO TRACKER" : !lostTarget() ? mode : doing(mode).every(isBlind) ? "BLIND" : "SEARCH";
}

// Time until a failsafe lands the drone, if nothing changes; "" if none is near.
export function landsIn(name) {
  const left = store.s.vehicles?.[name]?.lands_in_s ?? null;
  return left === null ? "" : `${Math.max(1, Math.round(left))} s`;
}

export const isUnheard = (name) => Boolean(store.s.vehicles?.[name]) && shownAgeS(store.s.vehicles[name].at) > HEARD_S;
// Whether its motors were cut, by it or for it: it may lie on its side, and an order to take off may do no more than end
// its emergency. Only an AR.Drone calls that an emergency.
export const isDown = (name) => store.s.vehicles?.[name]?.flight === "EMERGENCY" || (modeNow(name) === "CUT" && !mayHaveIgnoredCut(name));
// Whether its own camera has no light to see by.
export const isBlind = (name) => Boolean(store.s.cameras?.[`${name}_camera`]?.dark);
// In how many seconds one that stays lost lands at the latest; NaN for one that was never seen: only its driver knows.
export const unseenLeftS = (name) => (unseenS(name) < NEVER_S ? Math.max(0, store.scene.unseen_land_s - unseenS(name)) : NaN);

// Not seen for so long that it is searched for, or soon lands.
export const isLost = (name) => (entity(name)?.age_s ?? Infinity) + shownEstimateAge() > (store.scene?.lost_after_s ?? 3);
// Whether all targets are lost: where there is none, nobody searches.
export const lostTarget = () => Boolean(store.scene?.targets.length) && store.scene.targets.every(({ name }) => isLost(name));
// The drones in this mode now, among those with telemetry.
export const doing = (mode) => droneNames().filter((name) => modeOf(store.s.vehicles?.[name]) === mode);

export const NAMED = 4; // more drones than this are counted
// "drone_1 and turtlebot"; of many the drones are counted.
export function namedOrCounted(names) {
  const drones = names.filter((name) => !isTarget(name));
  return joined(drones.length > NAMED ? [`${drones.length} drones`, ...names.filter(isTarget)] : names);
}

const FEW = 2, LETTERS = 15; // names that have room below a word; letters that have it beside the figures
// Which drones are meant, if not all are.
function some(names) {
  const all = droneNames().length;
  if (names.length === all) return "";
  return names.length > FEW ? `${names.length} of ${all} drones` : names.join(", ");
}

// Airborne drones form the team until TRACK begins the task; a drone that still stands is about to follow.
export function stage() {
  const all = modes();
  if (runOver()) return "over";
  if (all.includes("LANDING") && !all.some((mode) => ALOFT.has(mode) && mode !== "LANDING")) return "land";
  if (all.includes("TAKING_OFF")) return "take-off";
  if (statuses().some(forms) && !all.includes("TRACK")) return all.includes("LANDED") ? "take-off" : "form";
  return aloft() ? "track" : store.s.flight?.flown ? "land" : "pre-flight";
}

const forms = ({ mode, detail }) => mode === "HOVER" && !waits(detail);
// After an order or a failsafe a drone hovers until RESUME.
export const waits = (detail) => detail.includes("RESUME");

// The present name of a stage: a team that lost the target searches for it, and no drone may be left in TRACK.
export function stageWord(name) {
  if (name !== "track" || stage() !== "track") return name;
  if (doing("TRACK").length) return lostTarget() ? "search" : name;
  return doing("HOLD").length ? "hold" : doing("HOVER").length ? "hover" : name;
}

// NaN once the run is over: nothing gets older any more.
export const oldestS = () => runOver() ? NaN : Math.max(estimateAge(), ...droneNames().map((name) => ageS(store.s.vehicles?.[name]?.at)));

// It ends with the run: then what counts is how long it had been silent.
const recorderSilentS = (recorder) => (runOver() ? (store.s.ended.at - recorder.at) / 1000 : shownAgeS(recorder.at));

export function recording() {
  const recorder = store.s.processes?.recorder;
  if (!recorder) return ["none", "warn"];
  if (recorderSilentS(recorder) > RECORDING_SILENT_S) return ["STOPPED", "bad"];
  if (runOver()) return ["ended", "calm"];
  return recorder.state === "READY" ? ["on", "good"] : [recorder.state.toLowerCase(), "warn"];
}
