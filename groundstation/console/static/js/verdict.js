// What the team does and who is lost, in a line that is always there, below the alarms; and what stands there without one.

import { lastsWords, worstBattery } from "./batteries.js";
import { joined } from "./dom.js";
import { landsIn } from "./duty.js";
import { refusalOf } from "./effects.js";
import { aloft, doing, lostTarget, modes, stage, teamMode } from "./glance.js";
import { mustWords, openMusts } from "./preflight.js";
import { droneNames, entity, estimateAge, store, trackerSilent } from "./store.js";

const FRESH_S = 1, NAMED = 4; // more drones than this are counted
// Of one, of several.
const DEEDS = {
  TRACK: ["tracks the target", "track the target"], HOVER: ["hovers", "hover"], HOLD: ["holds", "hold"], TAKING_OFF: ["takes off", "take off"],
  LANDING: ["lands", "land"], LANDED: ["stands", "stand"], CUT: ["has its motors cut", "have their motors cut"],
};
const LOOKS = ["looks for the target", "look for the target"];
const NEXT = {
  "TAKING OFF": "Each is seen from outside before the next one rises.",
  LANDING: "Who lands stays down until a new TAKE OFF.",
};

function deeds() {
  const counted = droneNames().length > NAMED, soon = droneNames().filter(landsIn);
  const modal = Object.entries(DEEDS).map(([mode, words]) => [doing(mode).filter((name) => !soon.includes(name)), mode === "TRACK" && lostTarget() ? LOOKS : words]);
  const told = [[soon, ["lands soon", "land soon"]], ...modal].filter(([names]) => names.length);
  const parts = told.map(([names, [one, many]]) => `${counted ? names.length : joined(names)} ${names.length > 1 ? many : one}`);
  return parts.length ? `${parts.join("; ")}.` : "";
}

// Who should be seen: the target, and who flies.
function sought() {
  const floor = new Set([...doing("LANDED"), ...doing("CUT"), ...doing("CONNECTING")]);
  return [...droneNames().filter((name) => !floor.has(name)), ...store.scene.targets.map(({ name }) => name)];
}

function lost() {
  if (trackerSilent()) return "Who is lost is not known while the tracker is silent.";
  const ages = sought().map((name) => [name, entity(name)]).map(([name, body]) => [name, body ? body.age_s + estimateAge() : Infinity]);
  const unseen = ages.filter(([, age]) => age > FRESH_S).map(([name, age]) => `${name} ${Number.isFinite(age) && age < 1e5 ? `for ${age.toFixed(0)} s` : "yet"}`);
  return unseen.length ? `Not seen: ${joined(unseen)}.` : "Nobody is lost.";
}

// What lets those go on that wait for it.
function start() {
  if (!refusalOf("RESUME")) return "RESUME lets them go on.";
  return refusalOf("TRACK") ? "" : "TRACK begins the task.";
}

// What a take-off waits for, or what it would be.
function takeOff() {
  const [first] = openMusts();
  if (first) return `TAKE OFF waits: ${mustWords(first)}.`;
  return store.s.flight?.flown ? "TAKE OFF flies again." : "TAKE OFF begins the flight.";
}

export function verdict() {
  if (!modes().length) return "Nothing is heard of the drones yet.";
  if (stage() === "over") return store.connected && !store.s.result ? "The run is over: it is being judged." : "The run is over.";
  if (!aloft()) return `Nobody flies. ${takeOff()}`;
  return [deeds(), lost(), NEXT[teamMode()[0]] ?? start()].filter(Boolean).join(" ");
}

// [kind, level, words]: what stands in the place of an alarm.
export function calm() {
  const battery = worstBattery();
  if (!battery || battery.level === "good") return ["none", "calm", modes().length ? "✓ No alarms" : "No alarms yet"];
  if (battery.value === null) return ["concern", "mild", `The battery of ${battery.name} is unknown`];
  const figures = [`${(100 * battery.value).toFixed(0)} %`, lastsWords(battery.name)].filter(Boolean).join(", ");
  return ["concern", "mild", `The battery of ${battery.name} is low: ${figures}`];
}
