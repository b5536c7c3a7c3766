// What a drone does now and why, in a sentence or two, and what limits it.

import { ageS, store } from "./store.js";

const FRESH_S = 1;
// Information [1/m²] from which a plan relies on a link, as in the report's doubts.
const RELIED_ON = 100;
const LIMITS = {
  fence: "the fence",
  separation: "the distance to another drone",
  speed: "its top speed",
  stale: "an old estimate",
  uncertain: "an uncertain place",
  unknown: "an unknown place",
};

// What limits a drone that follows its plan; "" if nothing does.
export function limitsOf(control) {
  const follows = store.s.vehicles?.[control?.robot]?.mode === "TRACK";
  return follows ? control.limited_by.map((limit) => LIMITS[limit] ?? limit).join(" and ") : "";
}

const joined = (names) => names.length > 1 ? `${names.slice(0, -1).join(", ")} and ${names.at(-1)}` : names[0];
const sentence = (words) => words ? `${words[0].toUpperCase()}${words.slice(1)}${/[.!?]$/.test(words) ? "" : "."}` : "";

function tracked(name, plan) {
  const relied = (plan.edges ?? []).filter(([, , information]) => information >= RELIED_ON);
  const watched = relied.filter(([observer]) => observer === name).map(([, subject]) => subject);
  const watchers = relied.filter(([, subject]) => subject === name).map(([observer]) => observer);
  const sought = Object.keys(store.s.estimate?.searches ?? {});
  const limits = limitsOf(plan.controls.find(({ robot }) => robot === name));
  const does = watched.length ? `watches ${joined(watched)}` : sought.length ? `looks for ${joined(sought)}` : "moves to where it will see more";
  const known = watchers.length ? `its place comes from ${joined(watchers)}` : "nobody sees it now";
  return sentence([does, known, limits && `limited by ${limits}`].filter(Boolean).join("; "));
}

// In TRACK what the plan has it do, unless its driver knows better; else the driver's own reason.
export function dutyOf(name) {
  const status = store.s.vehicles?.[name], plan = store.s.plan;
  if (!status) return "";
  const planned = status.mode === "TRACK" && !status.braked && status.flight !== "LOST" && plan && ageS(plan.at) < FRESH_S;
  return planned ? tracked(name, plan) : sentence(status.detail);
}

// In how many seconds a failsafe will land it, if nothing changes; "" if none is near.
export function landsIn(name) {
  const left = store.s.vehicles?.[name]?.lands_in_s ?? null;
  return left === null ? "" : `${left.toFixed(0)} s`;
}
