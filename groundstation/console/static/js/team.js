// A card for each drone and one for each target.

import { batteryWords, lastsWords } from "./batteries.js";
import { byId, el, seconds, svg, text } from "./dom.js";
import { ellipse95 } from "./geometry.js";
import { dutyOf } from "./duty.js";
import { aloft, doing, isBlind, isDown, isLost, landsIn, modeOf, modeWord, namedOrCounted, unsure, up } from "./glance.js";
import { withShortNames } from "./names.js";
import { give } from "./own_orders.js";
import { colourOf, isAgain } from "./palette.js";
import { ageS, entity, estimateAge, lagS, runOver, SEEN_S, seenBy, shownAgeS, store, trackerSilent, unseenS } from "./store.js";

const STALE_S = 1;
// In these modes a lost drone is shown as lost.
const STRAYS = new Set(["TRACK", "HOVER", "HOLD"]);
const LEVELS = { TRACK: "good", HOVER: "good", HOLD: "warn", TAKING_OFF: "warn", LANDING: "warn", CUT: "bad", LANDED: "calm", CONNECTING: "calm" };
const NARROW = matchMedia("(max-width: 1380px)"), LOW = matchMedia("(max-height: 990px)");
const FEW = 3, ROOM = 95; // cards; letters of what a drone does
const cards = new Map();

export function startTeam() {
  const button = byId("figures");
  button.onclick = () => button.setAttribute("aria-pressed", `${byId("team").classList.toggle("all")}`);
  for (const screen of [NARROW, LOW]) screen.onchange = fit;
}

// A low screen has room for three cards with all their lines; more drones stand in two columns where that is wide enough.
function fit() {
  const crowd = !NARROW.matches && store.scene?.drones.length > FEW;
  byId("team").classList.toggle("crowd", crowd);
  byId("team").classList.toggle("close", NARROW.matches || crowd || (LOW.matches && cards.size > FEW));
}

export function buildTeam() {
  cards.clear();
  const { drones, targets } = store.scene;
  const nodes = drones.map((drone) => card(drone.name, ["battery", "link", "heard", "seen", "rate", "speed", "position", "ellipse", "by"], true));
  for (const target of targets) nodes.push(card(target.name, ["seen", "speed", "position", "ellipse", "by"], false));
  byId("team").replaceChildren(...nodes);
  fit();
}

const TITLES = { battery: "battery", rate: "telemetry", link: "link", heard: "last heard", seen: "last seen", position: "position [m]", ellipse: "95 % sure within [m]", speed: "speed", by: "seen by" };
const BELIEF = ["position", "ellipse", "speed"];
// The figures kept on a screen that is read from 3 m, and on a low one.
const CHIEF = new Set(["battery", "seen"]), FIRST = { drone: new Set(["battery", "link", "heard", "seen"]), target: new Set(["seen", "speed", "by"]) };
const WIDE = new Set(["position", "ellipse", "by"]);

function card(name, fields, drone) {
  const values = Object.fromEntries(fields.map((field) => [field, el("dd", { data: { testid: `${name}-${field}` } })]));
  const mode = el("span", { class: "pill", data: { testid: `${name}-mode` } });
  const chip = svg("svg", { viewBox: "0 0 18 18", class: "chip", "aria-hidden": "true" });
  const detail = el("p", { class: "detail", data: { testid: `${name}-duty` } });
  const root = el("article", { class: drone ? "unit" : "unit target", "aria-label": name, data: { testid: `card-${name}` } },
    el("div", { class: "head" }, chip, el("strong", { title: name }, withShortNames(name)), mode), detail,
    el("dl", {}, ...fields.map((field) => el("div", { class: [WIDE.has(field) && "wide", field === "by" && "names", CHIEF.has(field) && "chief", FIRST[drone ? "drone" : "target"].has(field) && "first"].filter(Boolean).join(" ") }, el("dt", {}, TITLES[field]), values[field]))), drone ? actions(name) : null);
  cards.set(name, { root, values, mode, chip, detail, drone });
  paint(name);
  return root;
}

// Each in its place for good: a click that comes late must not find another button there.
function actions(name) {
  const button = (verb, words, effect) => {
    const kind = verb.toLowerCase(), what = el("small", { data: verb === "TAKEOFF" ? {} : { effect: verb, whom: name } }, effect);
    const made = el("button", { class: "small", data: { testid: `${name}-${kind}`, [kind]: name } }, words, what);
    made.onclick = () => give(verb, [name]);
    return made;
  };
  return el("div", { class: "actions", role: "group", "aria-label": `only ${name}` }, button("TAKEOFF", "Take off", ""), button("HOLD", "Hold", "hovers here"), button("LAND", "Land", "lands here"));
}

export function paint(only) {
  for (const [name, { root, chip, drone }] of cards) {
    if (only && name !== only) continue;
    root.style.setProperty("--own", colourOf(name));
    chip.replaceChildren(drone ? svg("path", { d: isAgain(name) ? "M9 2 V16 M2 9 H16" : "M4 4 L14 14 M14 4 L4 14", stroke: colourOf(name), "stroke-width": 3 }) : svg("circle", { cx: 9, cy: 9, r: 6, fill: "none", stroke: colourOf(name), "stroke-width": 3 }));
  }
}

export function showTeam() {
  for (const [name, parts] of cards) {
    if (parts.drone) showVehicle(name, parts);
    showBelief(name, parts);
  }
}

function showVehicle(name, { root, values, mode, detail }) {
  const status = store.s.vehicles?.[name], age = ageS(status?.at), stale = age > STALE_S || !store.connected;
  const silent = status && shownAgeS(status.at) > STALE_S && store.connected && !runOver();
  root.classList.toggle("stale", stale);
  const left = status && landsIn(name);
  const lost = status && STRAYS.has(status.mode) && !runOver() && !trackerSilent() && isLost(name);
  text(mode, silent ? "silent" : left ? `lands in ${left}` : lost ? "lost" : status ? modeWord(modeOf(status)).toLowerCase() : "no word yet");
  mode.dataset.level = silent || left ? "bad" : runOver() ? "calm" : lost ? "warn" : !status || stale ? "wait" : status.flight === "LOST" || status.flight === "EMERGENCY" ? "bad" : levelOf(status);
  const heard = values.heard;
  text(heard, status ? `${seconds(age)} ago` : "never");
  heard.className = age > 4 ? "empty" : age > STALE_S ? "low" : "";
  if (!status) return;
  showBattery(values.battery, name, status);
  text(values.rate, `${status.rate_hz.toFixed(0)} Hz`);
  values.rate.className = status.rate_hz < 1 ? "empty" : status.rate_hz < 10 ? "low" : "";
  showLink(values.link, status.link);
  showDuty(detail, name, silent);
}

// A drone that does as planned is green; one that searches, or is kept from its plan, is not.
function levelOf(status) {
  const mode = modeOf(status);
  return mode !== status.mode || (mode === "TRACK" && modeWord(mode) !== mode) ? "warn" : LEVELS[mode] ?? "wait";
}

// Of a vehicle that is not heard it is known what its driver does by itself.
function unheardWords(name) {
  if (!up([name]).length && !unsure([name]).length) return "It is not heard; it stood until then.";
  const { mode, flight } = store.s.vehicles[name];
  return `It is not heard: it ${[mode, flight].includes("LANDING") ? "lands" : "hovers, then lands by itself"}. Stops are sent to it.`;
}

function showDuty(node, name, silent) {
  text(node, silent ? unheardWords(name) : withShortNames(dutyOf(name, ROOM)));
  node.classList.toggle("low", Boolean(landsIn(name) || silent));
}

// The share of the packets or of the signal that arrives, as the driver reports it.
function showLink(node, share) {
  const level = share === null || share === undefined ? "unknown" : share < 0.3 ? "empty" : share < 0.6 ? "low" : "full";
  text(node, level === "unknown" ? "?" : `${(100 * share).toFixed(0)} %${{ full: "", low: " weak", empty: " bad!" }[level]}`);
  node.className = level === "low" || level === "empty" ? level : "";
  node.dataset.link = level;
}

function showBattery(node, name, status) {
  const [words, level] = batteryWords(name), known = status.battery !== null;
  text(node.previousElementSibling, lastsWords(name) || "battery");
  if (node.dataset.words === words) return;
  node.dataset.words = words;
  node.className = level;
  node.dataset.battery = status.charge;
  const fill = el("i");
  fill.style.width = `${Math.max(6, 100 * status.battery)}%`;
  node.replaceChildren(...(known ? [el("span", { class: "battery" }, fill)] : []), words);
}


function beliefWords(name, body, age, lost) {
  if (runOver()) return "The run is over.";
  if (trackerSilent()) return `${seenBy(name).length ? "In pictures, but its place" : "Its place"} is not known: the tracker is silent.`;
  if (lost && Number.isFinite(age) && !aloft()) return `Not seen for ${seconds(age)}: nobody flies to look for it.`;
  if (!body) return "";
  const trackers = doing("TRACK"), they = (one, many) => `${namedOrCounted(trackers)} ${trackers.length > 1 ? many : one} it.`;
  if (lost) return `Lost: nobody has seen it for ${seconds(age)}. ${trackers.length ? they("looks for", "look for") : ""}`.trim();
  if (age > SEEN_S) return `Not seen for ${seconds(age)}: ${body.anywhere ? "its place is unknown" : `it may be hidden near (${body.mean.slice(0, 2).map((value) => value.toFixed(1)).join(", ")})`}.`;
  return trackers.length ? `Seen: ${they("tracks", "track")}` : aloft() ? "Seen; nobody follows it now." : "Seen.";
}

// A fixed camera sees it, and no filter has it: it does not fly.
const standsInSight = (name) => (store.s.standing ?? []).some((one) => one.name === name);

// When it was last seen, with its level. Ages come from the tracker: of a silent one's bodies only the pictures tell.
function seenWords(name, body, age) {
  if (trackerSilent() && seenBy(name).length) return ["in view", ""];
  if (!body && standsInSight(name)) return [isDown(name) ? "it is down" : "it stands", ""];
  return Number.isFinite(age) ? [`${seconds(age)} ago`, age > 3 ? "empty" : age > 1 ? "low" : ""] : ["not yet", ""];
}

function showBelief(name, { root, values, mode, detail, drone }) {
  const body = entity(name), age = unseenS(name);
  const old = estimateAge() > STALE_S, lost = age > store.scene.lost_after_s;
  for (const field of BELIEF) values[field]?.parentElement.classList.toggle("old", old);
  if (!drone) {
    const dark = doing("TRACK").length && doing("TRACK").every(isBlind);
    const [search, words] = trackerSilent() ? [] : store.s.estimate?.searches?.[name] ?? [];
    text(mode, runOver() ? "run over" : trackerSilent() ? "place unknown" : Number.isFinite(age) && lost && !aloft() ? "not seen" : search || (lost && body) || !body ? (Number.isFinite(age) ? "lost" : "not found yet") : age > SEEN_S ? "not seen" : doing("TRACK").length ? "tracked" : "seen");
    mode.dataset.level = runOver() ? "calm" : !body || trackerSilent() ? "wait" : lost ? "bad" : search ? "warn" : age > SEEN_S ? "warn" : "good";
    text(detail, withShortNames((words || lost) && dark ? `Lost for ${seconds(age)}: nobody can look for it, the drones' pictures are dark.` : words ? `${Number.isFinite(age) ? "Lost" : "Not found yet"}: ${words}.` : beliefWords(name, body, age, lost)));
    root.classList.toggle("stale", estimateAge() > STALE_S || !store.connected);
  }
  const [seen, level] = seenWords(name, body, age + lagS());
  text(values.seen, seen);
  values.seen.className = level;
  text(values.by, withShortNames(seenBy(name).join(", ") || "nobody"));
  if (!body || body.anywhere) { for (const field of ["position", "ellipse", "speed"]) text(values[field], "unknown"); return; }
  const { major, minor } = ellipse95(body.cov);
  text(values.position, body.mean.slice(0, drone ? 3 : 2).map((value) => value.toFixed(2)).join("  "));
  text(values.ellipse, `${major.toFixed(2)} × ${minor.toFixed(2)}${body.converged ? "" : ", too unsure to fly by"}`);
  text(values.speed, !drone && (lost || trackerSilent()) ? "unknown" : `${Math.hypot(...body.velocity.slice(0, 2)).toFixed(2)} m/s`);
}
