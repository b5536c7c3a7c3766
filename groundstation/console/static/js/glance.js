// What the bar says of the whole team, worked out of the newest of everything.

import { ageS, droneNames, estimateAge, isTarget, entities, runOver, store, trackerSilent } from "./store.js";

const HEARD_S = 1; // as in groundstation/monitor/alarms.py
const RECORDING_SILENT_S = 3;
export const ALOFT = new Set(["TAKING_OFF", "HOVER", "HOLD", "TRACK", "LANDING"]);
export const STAGES = ["pre-flight", "take-off", "form", "track", "land", "over"];

const statuses = () => droneNames().map((name) => store.s.vehicles?.[name]).filter(Boolean);
// Its mode; HOVER as well while a failsafe keeps it from following the plan in TRACK.
export const modeOf = (status) => (status?.braked ? "HOVER" : status?.mode);
export const modeNow = (name) => store.s.vehicles?.[name]?.mode;
export const modes = (names = droneNames()) => names.map(modeNow).filter(Boolean);
export const aloft = () => modes().filter((mode) => ALOFT.has(mode)).length;
export const targetAgeS = () => Math.min(...entities().filter(({ name }) => isTarget(name)).map((body) => body.age_s + estimateAge()), Infinity);

// The most careful thing that any drone does is what the team does: [words, level, who does it if not all do].
export function teamMode() {
  const all = statuses().map(modeOf), silent = droneNames().filter((name) => store.s.vehicles?.[name] && ageS(store.s.vehicles[name].at) > HEARD_S);
  if (runOver()) return ["RUN OVER", "calm"];
  if (silent.length) return ["NOT HEARD", "bad", some(silent)];
  for (const [mode, level] of CAREFUL) if (all.includes(mode)) return [mode.replace("_", " "), level, some(doing(mode))];
  if (all.includes("TRACK")) return tracking();
  if (all.includes("HOVER")) return ["HOVER", "warn"];
  return all.length ? ["ON GROUND", "calm"] : ["–", "calm"];
}

const CAREFUL = [["CUT", "bad"], ["LANDING", "warn"], ["TAKING_OFF", "warn"], ["HOLD", "warn"]];

function tracking() {
  if (trackerSilent()) return ["NO TRACKER", "bad"];
  return lostTarget() ? ["SEARCH", "warn"] : ["TRACK", "good", some(doing("TRACK"))];
}

export const lostTarget = () => targetAgeS() > (store.scene?.lost_after_s ?? 3);
// Who does this now, among those that are heard of.
export const doing = (mode) => droneNames().filter((name) => modeOf(store.s.vehicles?.[name]) === mode);

const FEW = 2; // names that have room below a word
// Which drones are meant, if not all are.
function some(names) {
  const all = droneNames().length;
  if (names.length === all) return "";
  return names.length > FEW ? `${names.length} of ${all} drones` : names.join(", ");
}

// Who is up forms the team until TRACK begins the task; one that still stands is about to follow.
export function stage() {
  const all = modes();
  if (runOver()) return "over";
  if (all.includes("LANDING")) return "land";
  if (all.includes("TAKING_OFF")) return "take-off";
  if (all.includes("HOVER") && !all.includes("TRACK")) return all.includes("LANDED") ? "take-off" : "form";
  return aloft() ? "track" : store.s.flight?.flown ? "land" : "pre-flight";
}

// What a stage is called now: who has lost the target searches for it.
export const stageWord = (name) => (name === "track" && stage() === "track" && doing("TRACK").length && lostTarget() ? "search" : name);

// NaN once the run is over: nothing gets older any more.
export const oldestS = () => runOver() ? NaN : Math.max(estimateAge(), ...droneNames().map((name) => ageS(store.s.vehicles?.[name]?.at)));

// It ends with the run: then what counts is how long it had been silent.
const recorderSilentS = (recorder) => (runOver() ? (store.s.ended.at - recorder.at) / 1000 : ageS(recorder.at));

export function recording() {
  const recorder = store.s.processes?.recorder;
  if (!recorder) return ["none", "warn"];
  if (recorderSilentS(recorder) > RECORDING_SILENT_S) return ["STOPPED", "bad"];
  if (runOver()) return ["ended", "calm"];
  return recorder.state === "READY" ? ["on", "good"] : [recorder.state.toLowerCase(), "warn"];
}
