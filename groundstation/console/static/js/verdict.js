// What the team does and who is lost, in a line that is always there, below the alarms.

import { joined } from "./dom.js";
import { landsIn } from "./duty.js";
import { refusalOf, waiting } from "./effects.js";
import { aloft, doing, isLost, lostTarget, modes, stage, teamMode } from "./glance.js";
import { mustWords, openMusts } from "./preflight.js";
import { droneNames, entity, store, trackerSilent, unseenS } from "./store.js";

const NAMED = 4; // more drones than this are counted
// Of one, of several.
const DEEDS = {
  TRACK: ["tracks the target", "track the target"], HOVER: ["hovers", "hover"], HOLD: ["holds", "hold"], TAKING_OFF: ["takes off", "take off"],
  LANDING: ["lands", "land"], LANDED: ["stands", "stand"], CUT: ["has its motors cut", "have their motors cut"],
};
const LOOKS = ["looks for the target", "look for the target"];
const NEXT = {
  "TAKING OFF": "Each is seen from outside before the next one rises.",
  LANDING: "A drone that has landed stays down until a new TAKE OFF.",
};

// Whom a failsafe lands, told together where it is at the same time: [names, [words of one, of several]].
function landings(soon) {
  return [...new Set(soon.map(landsIn))].map((time) => [soon.filter((name) => landsIn(name) === time), [`lands by itself in ${time}`, `land by themselves in ${time}`]]);
}

function deeds() {
  const counted = droneNames().length > NAMED, soon = droneNames().filter(landsIn);
  const modal = Object.entries(DEEDS).map(([mode, words]) => [doing(mode).filter((name) => !soon.includes(name)), mode === "TRACK" && lostTarget() ? LOOKS : words]);
  const told = [...landings(soon), ...modal].filter(([names]) => names.length);
  const parts = told.map(([names, [one, many]]) => `${counted ? names.length : joined(names)} ${names.length > 1 ? many : one}`);
  return parts.length ? `${parts.join("; ")}.` : "";
}

// Who should be seen: the target, and who flies.
function sought() {
  const floor = new Set([...doing("LANDED"), ...doing("CUT"), ...doing("CONNECTING")]);
  return [...droneNames().filter((name) => !floor.has(name)), ...store.scene.targets.map(({ name }) => name)];
}

function since(name) {
  const age = unseenS(name);
  return Number.isFinite(age) && age < 1e5 ? `not seen for ${age.toFixed(0)} s` : "not seen yet";
}

// In pictures, and not localised.
const isUnplaced = (name) => !entity(name) && unseenS(name) <= store.scene.lost_after_s;

function lost() {
  if (trackerSilent()) return "Who is lost is not known: the tracker is silent.";
  const gone = sought().filter(isLost), unplaced = gone.filter(isUnplaced), unseen = gone.filter((name) => !isUnplaced(name)), spells = [...new Set(unseen.map(since))];
  const words = spells.map((spell) => `${joined(unseen.filter((name) => since(name) === spell))}, ${spell}`);
  const yet = unplaced.length ? ` It is not known yet where ${joined(unplaced)} ${unplaced.length > 1 ? "are" : "is"}.` : "";
  return `${words.length ? `Lost: ${words.join("; ")}` : "Nobody is lost"}.${yet}`;
}

// What lets those go on that wait for it.
function start() {
  const stay = waiting().filter((name) => !landsIn(name));
  if (stay.length && !refusalOf("RESUME")) return `RESUME lets ${stay.length > 1 ? "them" : stay[0]} go on with the task.`;
  return refusalOf("TRACK") ? "" : "TRACK begins the task.";
}

// What a take-off waits for, or what it would be.
function takeOff() {
  const [first] = openMusts();
  if (first) return `TAKE OFF waits: ${mustWords(first)}.`;
  return store.s.flight?.flown ? "TAKE OFF flies again." : "TAKE OFF begins the flight.";
}

export function verdict() {
  if (!modes().length) return "No drone has been heard yet.";
  if (stage() === "over") return store.connected && !store.s.result ? "The run is over: it is being judged." : "The run is over.";
  if (!aloft()) return `Nobody flies. ${takeOff()}`;
  return [deeds(), lost(), NEXT[teamMode()[0]] ?? start()].filter(Boolean).join(" ");
}
