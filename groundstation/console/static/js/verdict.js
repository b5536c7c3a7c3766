// The line below the alarms, always shown: the team's activity and the lost entities.

import { joined, seconds } from "./dom.js";
import { howMany, ready, refusalOf, waiting } from "./effects.js";
import { aloft, doing, isBlind, isLost, isUnheard, landsIn, lostTarget, modeNow, modes, NAMED, namedOrCounted, stage, standing, unseenLeftS, unsure, up } from "./glance.js";
import { mustWords, openMusts } from "./preflight.js";
import { droneNames, entity, NEVER_S, SEEN_S, seenBy, store, trackerSilent, unseenS } from "./store.js";

// Of one, of several.
const DEEDS = {
  TRACK: ["tracks the target", "track the target"], HOVER: ["hovers", "hover"], TAKING_OFF: ["takes off", "take off"],
  LANDING: ["lands", "land"], LANDED: ["stands", "stand"], CUT: ["has its motors off", "have their motors off"],
};
const LOOKS = ["looks for the target", "look for the target"], BLIND = ["has no light to see by", "have no light to see by"];
const ALONE = ["hovers, then lands", "hover, then land"];
const UNHEARD = ["is not heard", "are not heard"], UNSEEN = ["flies on unseen", "fly on unseen"];
const NEXT = {
  TAKING_OFF: "Each is seen from outside before the next one rises.",
  LANDING: "A drone that has landed stays down until a new TAKE OFF.",
};

// The drones that a failsafe lands, grouped by the time: [names, [words of one, of several]].
function landings(soon) {
  return [...new Set(soon.map(landsIn))].map((time) => [soon.filter((name) => landsIn(name) === time), [`starts to land by itself in ${time}`, `start to land by themselves in ${time}`]]);
}

function deeds() {
  const counted = droneNames().length > NAMED, deaf = up().filter(isUnheard), soon = droneNames().filter((name) => landsIn(name) && !deaf.includes(name));
  const stray = counted || trackerSilent() || lostTarget() ? [] : doing("TRACK").filter((name) => isLost(name) && !soon.includes(name) && !deaf.includes(name)), named = [...deaf, ...soon, ...stray];
  const doers = (mode) => (mode === "HOVER" ? droneNames().filter((name) => [...doing(mode), ...doing("HOLD")].includes(name)) : doing(mode));
  const modal = Object.entries(DEEDS).map(([mode, words]) => [doers(mode).filter((name) => !named.includes(name)), mode !== "TRACK" ? words : trackerSilent() ? ALONE : !lostTarget() ? words : doing(mode).every(isBlind) ? BLIND : LOOKS]);
  const told = [[deaf, UNHEARD], ...landings(soon), ...modal, [stray, UNSEEN]].filter(([names]) => names.length);
  const parts = told.map(([names, [one, many]]) => `${counted ? names.length : joined(names)} ${names.length > 1 ? many : one}`);
  return parts.length ? `${parts.join("; ")}.` : "";
}

// The entities that should be seen: the target, and flying drones.
function sought() {
  const floor = new Set([...standing(), ...doing("CONNECTING")]);
  return [...droneNames().filter((name) => !floor.has(name)), ...store.scene.targets.map(({ name }) => name)];
}

// "drone_1 and turtlebot, not seen for 4 to 7 s".
function unseenFor(names) {
  const ages = names.map(unseenS), seen = names.filter((_, index) => ages[index] < NEVER_S), never = names.filter((name) => !seen.includes(name));
  const known = ages.filter((age) => age < NEVER_S), [least, most] = [Math.min(...known), Math.max(...known)].map((age) => age.toFixed(0));
  return [seen.length && `${namedOrCounted(seen)}, not seen for ${least === most ? "" : `${least} to `}${most} s`, never.length && `${namedOrCounted(never)}, not seen yet`].filter(Boolean).join("; ");
}

// In pictures, and not localised: never yet, or its pictures contradict its estimate for long.
const isUnplaced = (name) => unseenS(name) <= store.scene.lost_after_s && (entity(name)?.unplaced_s ?? Infinity) > store.scene.lost_after_s;

// The entities that cameras see, known without the tracker.
function inPictures() {
  const all = sought(), seen = all.filter((name) => seenBy(name).length);
  return seen.length ? `; cameras still see ${seen.length === all.length ? "all" : namedOrCounted(seen)}` : "";
}

function lost() {
  if (trackerSilent()) return `No tracker tells if anyone is lost${inPictures()}.`;
  const gone = sought().filter((name) => isLost(name) || isUnplaced(name)), unplaced = gone.filter(isUnplaced), unseen = gone.filter((name) => !isUnplaced(name));
  const yet = unplaced.length ? ` It is not known yet where ${joined(unplaced)} ${unplaced.length > 1 ? "are" : "is"}.` : "";
  const others = unseen.length ? `Lost: ${unseenFor(unseen)}.` : unplaced.length ? "" : `Nobody is lost${unseenYet()}.`;
  return `${others}${yet}`.trim();
}

// The entities that would be lost next.
function unseenYet() {
  const unseen = sought().filter((name) => unseenS(name) > SEEN_S && !isLost(name));
  const left = Math.max(0, store.scene.lost_after_s - Math.max(...unseen.map(unseenS)));
  return unseen.length ? ` (${namedOrCounted(unseen)} not seen just now: ${unseen.length > 1 ? "the first " : ""}counts as lost in ${seconds(left)})` : "";
}

// The command that lets waiting drones go on.
function start() {
  const task = lostTarget() ? "search" : "track", stay = waiting().filter((name) => !landsIn(name)), them = (names) => (names.length > 1 ? "them" : names[0]);
  if (stay.length && !refusalOf("RESUME")) return `RESUME lets ${them(stay)} ${task}.`;
  const next = ready().filter((name) => !landsIn(name));
  return refusalOf("TRACK") || !next.length ? "" : `TRACK lets ${them(next)} ${task}.`;
}

// The finding that a take-off waits for, or the meaning of TAKE OFF now.
function takeOff() {
  const [first] = openMusts();
  if (first) return `TAKE OFF waits: ${mustWords(first)}.`;
  return store.s.flight?.flown ? "TAKE OFF flies again." : "TAKE OFF begins the flight.";
}

// The next step if all flying drones are in the same mode.
const next = () => (new Set(up().map(modeNow)).size === 1 ? NEXT[modeNow(up()[0])] : undefined);

export function verdict() {
  if (!modes().length) return "No drone has been heard yet.";
  if (stage() === "over") return store.connected && !store.s.result ? "The run is over: it is being judged." : "The run is over.";
  const doubt = unsure();
  if (!aloft()) return `${doubt.length ? `It is not known whether ${namedOrCounted(doubt)} ${doubt.length > 1 ? "fly" : "flies"}` : "Nobody flies"}. ${takeOff()}`;
  return [deeds(), lost(), next() ?? start()].filter(Boolean).join(" ");
}

// The drones that will land by themselves, why and when, in two short lines; "" if none will.
export function landingWords() {
  const bound = up().filter((name) => landsIn(name) && !isUnheard(name)), [soonest] = [...bound].sort((a, b) => parseInt(landsIn(a)) - parseInt(landsIn(b)));
  if (soonest) {
    const time = landsIn(soonest), soon = bound.filter((name) => landsIn(name) === time), why = trackerSilent() ? "no tracker" : soon.every(isLost) ? "unseen" : "";
    return why ? `${why}: ${howMany(soon)}\nlanding in ${time}` : `${howMany(soon)} ${soon.length > 1 ? "start" : "starts"} to\nland in ${time}`;
  }
  const on = up().filter((name) => modeNow(name) !== "LANDING"), unheard = on.filter(isUnheard), gone = on.filter(isLost);
  if (unheard.length) return hovering(unheard, "not heard");
  if (trackerSilent()) return on.length ? hovering(on, "no tracker") : "";
  const left = Math.min(...gone.map(unseenLeftS));
  return gone.length ? `unseen: ${howMany(gone)}\n${gone.length > 1 ? "land" : "lands"} ${Number.isFinite(left) ? `within ${left.toFixed(0)} s` : "unless seen"}` : "";
}

// For how long it hovers first, only its driver knows.
const hovering = (names, why) => `${why}: ${howMany(names)}\n${names.length > 1 ? "hover, then land" : "hovers, then lands"}`;
