// What a drone does now and why, in a sentence or two, and what limits it.

import { joined } from "./dom.js";
import { ageS, store } from "./store.js";

const FRESH_S = 1;
// Information [1/m²] from which a plan relies on a link, as in the report's doubts.
const RELIED_ON = 100;
const LIMITS = {
  fence: "the fence",
  separation: "a drone nearby",
  speed: "its top speed",
  stale: "an old estimate",
  uncertain: "an uncertain place",
  unknown: "an unknown place",
};

// What limits a drone that follows its plan; "" if nothing does.
export function limitsOf(control) {
  const status = store.s.vehicles?.[control?.robot];
  return status?.mode === "TRACK" && !status.braked ? control.limited_by.map((limit) => LIMITS[limit] ?? limit).join(" and ") : "";
}

const sentence = (words) => words ? `${words[0].toUpperCase()}${words.slice(1)}${/[.!?]$/.test(words) ? "" : "."}` : "";

function tracked(name, plan) {
  const relied = (plan.edges ?? []).filter(([, , information]) => information >= RELIED_ON);
  const watched = relied.filter(([observer]) => observer === name).map(([, subject]) => subject);
  const watchers = relied.filter(([, subject]) => subject === name).map(([observer]) => observer);
  const sought = Object.keys(store.s.estimate?.searches ?? {});
  const limits = limitsOf(plan.controls.find(({ robot }) => robot === name));
  const does = watched.length ? `watches ${joined(watched)}` : sought.length ? `looks for ${joined(sought)}` : "moves to where it will see more";
  const known = watchers.length ? `${name} is located by ${joined(watchers)}` : `nobody sees ${name} now`;
  return sentence([does, known, limits && `limited by ${limits}`].filter(Boolean).join("; "));
}

// The driver's own reason; what it is the reason for, where it does not say so, and who ordered what "landing for" says.
function reasonOf({ mode, detail }) {
  if (mode === "LANDED" || mode === "CUT") return `stands with its motors off: ${detail}`;
  const [, doing, who] = detail.match(/^(landing|taking off) for (.+)$/) ?? [];
  if (who) return `${doing === "landing" ? "lands" : "takes off"}: ordered by ${who}`;
  return mode === "LANDING" && detail && !detail.startsWith("land") ? `lands: ${detail}` : detail;
}

// In TRACK what the plan has it do, unless its driver knows better; else the driver's own reason.
export function dutyOf(name) {
  const status = store.s.vehicles?.[name], plan = store.s.plan;
  if (!status) return "";
  const planned = status.mode === "TRACK" && !status.braked && status.lands_in_s === null && status.flight !== "LOST" && plan && ageS(plan.at) < FRESH_S;
  const goesOn = status.mode === "TRACK" && !status.braked && status.lands_in_s !== null ? "Follows its plan still. " : "";
  return planned ? tracked(name, plan) : goesOn + sentence(reasonOf(status));
}

// In how many seconds a failsafe will land it, if nothing changes; "" if none is near.
export function landsIn(name) {
  const left = store.s.vehicles?.[name]?.lands_in_s ?? null;
  return left === null ? "" : `${left.toFixed(0)} s`;
}
