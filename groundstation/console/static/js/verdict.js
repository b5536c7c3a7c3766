// One sentence on the whole team, where an alarm would stand: what it does, and what an operator may do about it.

import { aloft, modes, stage, targetAgeS, teamMode, worstBattery } from "./glance.js";
import { droneNames, entity, estimateAge, store } from "./store.js";

const FRESH_S = 1;

const NEXT = {
  "TAKING OFF": "Each is seen from outside before the next one rises.",
  HOVER: "They hover: the cards say why.",
  SEARCH: "Nobody sees the target: they look for it.",
  LANDING: "Those that land stay down until a new TAKE OFF.",
  CUT: "Motors were cut.",
};

// Why they hover, in the words of the first driver that says it.
function held() {
  const status = droneNames().map((name) => store.s.vehicles?.[name]).find((one) => one?.mode === "HOLD" && one.detail);
  return `They hover${status ? ` (${status.detail})` : " because of an order or a failsafe"}: RESUME lets them go on.`;
}

function next(mode) {
  if (mode === "HOLD") return held();
  if (mode === "TRACK") return targetAgeS() <= FRESH_S ? "The target is seen." : "Nobody sees the target just now.";
  return NEXT[mode] ?? "";
}

// How many drones have a place that is newer than a second.
function localised() {
  return droneNames().filter((name) => { const body = entity(name); return body && body.age_s + estimateAge() < FRESH_S; }).length;
}

// What is no alarm yet, and no calm either.
function concern() {
  const battery = worstBattery();
  if (!battery || battery.level === "good") return "No alarms.";
  return `No alarms, but the battery of ${battery.name} is ${battery.value === null ? "unknown" : "low"}.`;
}

export function verdict() {
  const all = droneNames().length, up = aloft(), [mode] = teamMode();
  if (!all || !modes().length) return "No alarms. Nothing is heard of the drones yet.";
  if (stage() === "over") return "The run is over: nothing flies.";
  if (!up) return `${concern()} Nobody flies. ${store.s.flight?.flown ? "TAKE OFF flies again." : "TAKE OFF begins the flight."}`;
  return `${concern()} ${up} of ${all} fl${up === 1 ? "ies" : "y"}, the places of ${localised()} of ${all} are known. ${next(mode)}`.trim();
}
