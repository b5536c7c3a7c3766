// A drone's present action and its reason, in a sentence or two, and its limits.

import { joined, seconds } from "./dom.js";
import { isBlind, isDown, isLost, standing, unseenLeftS } from "./glance.js";
import { droneNames, isSeen, NEVER_S, SEEN_S, seenBy, shownAgeS, store, trackerSilent, unseenS } from "./store.js";
import { askedBy, ordered } from "./who.js";

const FRESH_S = 1;
// Information [1/m²] from which a plan relies on a link, as in the report's doubts.
const RELIED_ON = 100;
const LIMITS = {
  fence: "the fence",
  separation: "a drone nearby",
  obstacle: "an obstacle",
  speed: "its speed limit",
  "yaw rate": "how fast it may turn",
  stale: "an old estimate",
  "stale plan": "an old plan",
  uncertain: "an uncertain place",
  unknown: "an unknown place",
};

// What limits a drone that follows its plan; "" if nothing does.
export function limitsOf(control) {
  const status = store.s.vehicles?.[control?.robot];
  return status?.mode === "TRACK" && !status.braked ? control.limited_by.map((limit) => LIMITS[limit] ?? limit).join(" and ") : "";
}

const sentence = (words) => words ? `${words[0].toUpperCase()}${words.slice(1)}${/[.!?]$/.test(words) ? "" : "."}` : "";

function tracked(name, plan, room) {
  const relied = (plan.edges ?? []).filter(([, , information]) => information >= RELIED_ON);
  const watchers = seenBy(name);
  const targets = targetNames(), sought = targets.filter(isLost);
  const planned = relied.filter(([observer, subject]) => observer === name && !sought.includes(subject)).map(([, subject]) => subject);
  const inView = targets.filter((target) => !sought.includes(target) && seenBy(target).includes(name));
  const watched = [...new Set([...planned.filter((subject) => isSeen(name, subject)), ...inView])];
  const limits = limitsOf(plan.controls.find(({ robot }) => robot === name));
  const [, who] = store.s.vehicles[name].detail.match(/^tracking for (.+)$/) ?? [];
  const task = taskOf(name);
  const how = watched.length ? `: watches ${watching(watched, targets)}` : sought.length ? "" : `: moves to where it will see ${watching(planned.slice(0, 1), targets)}`;
  const known = isLost(name) ? "" : watchers.length ? `Seen by ${joined(watchers.map(watcher))}.` : `${unseen(name)}.`;
  const does = (order) => (isLost(name) ? `${unseen(name)}. Until then it ${task}.` : sentence(`${task}${order}${how}`));
  const told = (order) => [does(order), known, limits && `Slowed by ${limits}.`].filter(Boolean).join(" ");
  // Where a card has no room for who asked, the list of orders says it.
  const why = sought.length ? ", which nobody sees" : who ? `, ${orderedBy(who, name, "tracking")}` : "";
  const whole = told(isBlind(name) ? "" : why);
  return whole.length > room ? told("") : whole;
}

const targetNames = () => store.scene.targets.map((target) => target.name);

function taskOf(name) {
  const targets = targetNames(), sought = targets.filter(isLost);
  const search = isBlind(name) ? "has no light to look for" : "looks for";
  return sought.length ? `${search} ${joined(sought)}` : `tracks ${joined(targets) ?? "its target"}`;
}

// A drone that watches no target watches drones for the sake of their places; the only target was just named.
function watching(names, targets) {
  if (!names.length || (targets.length === 1 && names.length === 1 && names[0] === targets[0])) return "it";
  const purpose = names.every((name) => droneNames().includes(name)) ? `, to know where ${names.length > 1 ? "they are" : `${names[0]} is`}` : "";
  return `${joined(names)}${purpose}`;
}

const watcher = (name) => (droneNames().includes(name) || name.endsWith("camera") ? name : `${name} camera`);

const within = (name) => (Number.isFinite(unseenLeftS(name)) ? ` within ${unseenLeftS(name).toFixed(0)}\u00a0s` : " by itself");

// A drone that stays lost lands; the place of an unseen drone may be known by its own observations of others.
function unseen(name) {
  const age = unseenS(name), [where, end] = seenBy(name).length ? [", though in view", "found"] : ["", "seen"];
  if (isLost(name)) return `${age < NEVER_S ? "Lost" : "Not seen yet"}${where}: lands${within(name)}, unless ${end}`;
  if (age <= SEEN_S) return "Out of view: its own camera tells where it is";
  return `Itself not seen for ${seconds(age)}: counts as lost in ${seconds(Math.max(0, store.scene.lost_after_s - age))}`;
}

const ORDERS = /^(landing|taking off|held|tracking|motors cut) (?:for|by) (.+)$/;
const ORDERED = { landing: "lands:", "taking off": "takes off:", held: "hovers in place: HOLD", tracking: "tracks:", "motors cut": "falls, or flies on: CUT MOTORS" };

const VERBS = { landing: ["LAND"], "taking off": ["TAKEOFF"], held: ["HOLD"], tracking: ["TRACK", "RESUME"], "motors cut": ["CUT_MOTORS"] };

// Drivers name the program that an order came from; of a page's, and of what it asked the terminal for, it is known who gave
// the last one of its kind.
function orderedBy(who, name, doing) {
  const last = (store.s.orders ?? []).find((order) => VERBS[doing].includes(order.verb) && order.rows.some((row) => row.name === name));
  return ordered((last && askedBy(last)) || (who !== "console" ? who : last?.by ?? "a page"));
}

const NEEDED = /; RESUME is needed$/;
const NOT_DOWN = /^it (does not come down|stands on the floor)/;
// The drone's action until a failsafe lands it.
const GOES_ON = { TRACK: taskOf, HOLD: () => "hovers", HOVER: () => "hovers" };

// The driver's own reason; what it is the reason for, where it does not say so, and who ordered what "landing for" says.
function reasonOf(name, { mode, detail, lands_in_s, braked }) {
  if (standing([name]).length) return stands(name, detail);
  const [, doing, who] = detail.match(ORDERS) ?? [];
  if (who) return `${ORDERED[doing]} ${orderedBy(who, name, doing)}`;
  if (lands_in_s !== null && !braked && mode in GOES_ON && detail) return `${GOES_ON[mode](name)}, then lands: ${detail.replace(NEEDED, ". RESUME lets it go on")}`;
  if (mode === "LANDING" && NOT_DOWN.test(detail)) return detail;
  if (mode === "LANDING" && detail && !detail.startsWith("land")) return `lands: ${detail}`;
  return mode === "HOVER" && NEEDED.test(detail) ? `hovers: ${detail.replace(NEEDED, "")}. RESUME lets it go on` : detail;
}

// Why it landed stands in brackets in its driver's words.
function stands(name, detail) {
  const [, why] = detail.match(/^landed \((.+)\)$/) ?? [], [, doing, who] = (why ?? detail).match(ORDERS) ?? [];
  if (doing === "motors cut") return `is on the floor, motors off: CUT MOTORS ${orderedBy(who, name, doing)}`;
  if (isDown(name)) return "is on the floor: it cut its motors itself";
  return why ? `stands, motors off. ${who ? `It landed, ${orderedBy(who, name, doing)}` : `Reason for landing: ${why}`}` : `stands with its motors off${detail && `: ${detail}`}`;
}

// In TRACK what the plan has it do, unless its driver knows better; else the driver's own reason. room: letters.
export function dutyOf(name, room) {
  const status = store.s.vehicles?.[name], plan = store.s.plan;
  if (!status) return "";
  const planned = status.mode === "TRACK" && !status.braked && status.lands_in_s === null && status.flight !== "LOST" && plan && shownAgeS(plan.at) < FRESH_S;
  if (planned && trackerSilent()) return "Told to track; without the tracker it hovers, then lands.";
  return planned ? tracked(name, plan, room) : `${sentence(reasonOf(name, status))}${stray(name, status)}`;
}

// Of one that hovers and is lost: it will not stay where it is.
function stray(name, { mode, lands_in_s }) {
  return ["HOLD", "HOVER"].includes(mode) && lands_in_s === null && !trackerSilent() && isLost(name) ? ` ${unseen(name)}.` : "";
}
