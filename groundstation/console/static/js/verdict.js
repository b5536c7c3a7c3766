// What the team does and who is lost, in a line that is always there, below the alarms.

import { joined } from "./dom.js";
import { landsIn } from "./duty.js";
import { ready, refusalOf, waiting } from "./effects.js";
import { aloft, doing, isLost, lostTarget, modes, stage, standing, teamMode } from "./glance.js";
import { mustWords, openMusts } from "./preflight.js";
import { droneNames, entity, SEEN_S, store, trackerSilent, unseenS } from "./store.js";

const NAMED = 4; // more drones than this are counted
// Of one, of several.
const DEEDS = {
  TRACK: ["tracks the target", "track the target"], HOVER: ["hovers", "hover"], HOLD: ["hovers", "hover"], TAKING_OFF: ["takes off", "take off"],
  LANDING: ["lands", "land"], LANDED: ["stands", "stand"], CUT: ["has its motors cut", "have their motors cut"],
};
const LOOKS = ["looks for the target", "look for the target"], ALONE = ["is without the tracker", "are without the tracker"];
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
  const modal = Object.entries(DEEDS).map(([mode, words]) => [doing(mode).filter((name) => !soon.includes(name)), mode !== "TRACK" ? words : trackerSilent() ? ALONE : lostTarget() ? LOOKS : words]);
  const told = [...landings(soon), ...modal].filter(([names]) => names.length);
  const parts = told.map(([names, [one, many]]) => `${counted ? names.length : joined(names)} ${names.length > 1 ? many : one}`);
  return parts.length ? `${parts.join("; ")}.` : "";
}

// Who should be seen: the target, and who flies.
function sought() {
  const floor = new Set([...standing(), ...doing("CONNECTING")]);
  return [...droneNames().filter((name) => !floor.has(name)), ...store.scene.targets.map(({ name }) => name)];
}

const NEVER_S = 1e5;

// "drone_1 and turtlebot, not seen for 4 to 7 s".
function unseenFor(names) {
  const ages = names.map(unseenS), seen = names.filter((_, index) => ages[index] < NEVER_S), never = names.filter((name) => !seen.includes(name));
  const known = ages.filter((age) => age < NEVER_S), [least, most] = [Math.min(...known), Math.max(...known)].map((age) => age.toFixed(0));
  return [seen.length && `${joined(seen)}, not seen for ${least === most ? "" : `${least} to `}${most} s`, never.length && `${joined(never)}, not seen yet`].filter(Boolean).join("; ");
}

// In pictures, and not localised.
const isUnplaced = (name) => !entity(name) && unseenS(name) <= store.scene.lost_after_s;

function lost() {
  if (trackerSilent()) return "Whether anybody is lost is not known: the tracker is silent.";
  const gone = sought().filter(isLost), unplaced = gone.filter(isUnplaced), unseen = gone.filter((name) => !isUnplaced(name));
  const yet = unplaced.length ? ` It is not known yet where ${joined(unplaced)} ${unplaced.length > 1 ? "are" : "is"}.` : "";
  return `${unseen.length ? `Lost: ${unseenFor(unseen)}` : `Nobody is lost${unseenYet()}`}.${yet}`;
}

// Who would be lost next.
function unseenYet() {
  const { lost_after_s: limit } = store.scene, unseen = sought().filter((name) => unseenS(name) > SEEN_S && !isLost(name));
  return unseen.length ? ` (${joined(unseen)} not seen just now: lost after ${limit} s)` : "";
}

// What lets those go on that wait for it.
function start() {
  const task = lostTarget() ? "search" : "track", stay = waiting().filter((name) => !landsIn(name)), them = (names) => (names.length > 1 ? "them" : names[0]);
  if (stay.length && !refusalOf("RESUME")) return `RESUME lets ${them(stay)} ${task}.`;
  const next = ready().filter((name) => !landsIn(name));
  return refusalOf("TRACK") || !next.length ? "" : `TRACK lets ${them(next)} ${task}.`;
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
