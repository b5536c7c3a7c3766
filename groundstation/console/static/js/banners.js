// The strip of alarms: whether it is safe, in a word; then what asks for an act, and the gravest.

import { showLog, showMore } from "./alarm_strip.js";
import { byId, el, seconds, text } from "./dom.js";
import { resultWords } from "./ending.js";
import { modeNow, unsure, up } from "./glance.js";
import { drawn } from "./map.js";
import { withShortNames } from "./names.js";
import { noteOwnAlarms, ownAlarms, slowWords } from "./own_alarms.js";
import { momentWords } from "./playback.js";
import { estimateAge, estimateOld, linkSlow, replaying, runOver, silentS, store, trackerSilent } from "./store.js";
import { landingWords } from "./verdict.js";

const SHOWN = 4, NOTICE_MS = 8000, LEVELS = { SAFE: "good", WATCH: "warn", ACT: "bad" };
const MEANS = { SAFE: "no problem", WATCH: "a problem, but\nno need to act", ACT: "a problem:\nact now" };
const COLOURS = { ACT: "grave", WATCH: "mild" };  // an alarm's is that of its word
const WIDE = matchMedia("(min-width: 1400px)"), ROOM = 110; // letters
// Alarms left out without the tracker: its silence is shown already, and it is not known which drones are lost.
const MOOT = /^process tracker silent$| lost$/;
const notices = [];

export function addNotice({ text: words, grave }) {
  notices.push({ words, grave, at: performance.now() });
  if (notices.length > 3) notices.shift();
}

// Each: what a test finds it by, its colour, its words, what follows, and its rank: ACT, WATCH or a notice. shell: whether
// only a shell helps.
function banners(own) {
  const { ended } = store.s;
  const all = [...(ended ? [ending(ended)] : []), ...own.map((alarm) => ({ ...alarm, level: "grave", rank: "ACT" }))];
  if (!runOver() && !own.some(({ old }) => old)) {
    if (trackerSilent()) all.push(silentTracker());
    else if (linkSlow() && estimateOld()) all.push(slowLink());
  }
  for (const { words, grave } of notices.filter(({ at }) => performance.now() - at < NOTICE_MS)) all.push({ kind: "notice", level: grave ? "grave" : "mild", title: words, rank: "notice" });
  const told = (store.s.alarms ?? []).filter(({ about }) => about !== "tracker silent" && !(trackerSilent() && MOOT.test(about))).map((alarm) => ({ kind: "alarm", level: alarm.grave ? "grave" : "mild",
    title: alarm.told === null ? alarm.text : `${alarm.text} (told at ${momentWords(alarm.told)})`, more: alarm.advice, subject: subjectOf(alarm), rank: alarm.asks ? "ACT" : "WATCH" }));
  if (store.connected && !runOver()) all.push(...together(told).slice(0, SHOWN));
  if (!all.length && !replaying()) all.push({ kind: "none", level: "calm", title: store.s.safety?.reason ?? "No alarms yet." });
  const urgency = ({ level, rank }) => (rank === "ACT" ? 0 : level === "grave" ? 1 : 2);
  return all.sort((a, b) => urgency(a) - urgency(b));
}

// "drone_1 lost"; of a suspicion what it suspects, without its reasons.
const subjectOf = ({ about, text: words }) => (about.startsWith("suspected ") ? words : about === "dark" ? "dark pictures" : about);

// Where there is room, alarms with the same advice stand in one line: the second is no less than the first.
function together(alarms) {
  const all = [];
  for (const alarm of alarms) {
    const same = WIDE.matches && all.find((other) => other.more && other.more === alarm.more && other.rank === alarm.rank && other.level === alarm.level && other.title.length + alarm.title.length < ROOM);
    if (same) Object.assign(same, { title: `${same.title}; ${alarm.title}`, subject: `${same.subject}, ${alarm.subject}` });
    else all.push(alarm);
  }
  return all;
}

// down: whether all drones are on the ground, whatever ended the run; null: not known, and nobody is known to fly.
const endWord = ({ severity, down }) => (down ? (severity === "INFO" ? "SAFE" : "WATCH") : down === null && severity !== "ERROR" ? "WATCH" : "ACT");

function ending(ended) {
  const { text: words, down } = ended, word = endWord(ended), calm = word === "SAFE", title = [words[0].toUpperCase() + words.slice(1), resultWords()].filter(Boolean).join(". ");
  return { kind: "ended", level: calm ? "calm" : "grave", title, more: runOver() ? "This run takes no more orders: the stop buttons are off." : "", shell: !down, rank: calm ? undefined : word };
}

function silentTracker() {
  const flying = up(), then = !flying.length ? (unsure().length ? "nobody is known to fly" : "nobody flies") : flying.every((name) => modeNow(name) === "LANDING") ? "the drones land" : "the drones hover, then land by themselves. LAND ALL still works";
  return { kind: "tracker", level: "grave", title: `TRACKER SILENT for ${seconds(estimateAge())}${WIDE.matches ? ": the program that steers the drones sends nothing" : ""}`, rank: "WATCH",
    more: `Nothing to do: ${then}.` };
}

const slowLink = () => ({ kind: "slow", level: "grave", title: slowWords(), rank: "WATCH", more: "Nothing to do yet. Stops go out at once." });

// As the console's process judges it, but for what only this page can know.
function safetyWord(own) {
  const { ended, safety } = store.s;
  if (ended) return endWord(ended);
  const level = own.length ? "ACT" : safety?.level ?? "WATCH";
  return level === "SAFE" && estimateOld() ? "WATCH" : level;
}

export function showBanners() {
  const own = ownAlarms(), all = banners(own), word = safetyWord(own);
  text(byId("safety"), word);
  const over = store.s.ended?.down && word === "SAFE" && "all are on\nthe ground", unheard = !store.s.safety && !store.s.ended && word === "WATCH" && "nothing is\nheard yet";
  text(byId("safety-means"), over || unheard || (word === "WATCH" && !replaying() && !store.s.ended && store.scene && landingWords()) || MEANS[word]);
  byId("safety-box").dataset.level = LEVELS[word];
  document.body.dataset.safety = word;
  noteOwnAlarms(own);
  const host = byId("banners"), kinds = all.map(({ kind }) => kind).join();
  if (host.dataset.kinds !== kinds) {
    noteSilence(kinds.split(","), (host.dataset.kinds ?? "").split(","), { tracker: estimateAge(), silent: silentS() });
    host.dataset.kinds = kinds;
    host.replaceChildren(...all.map(({ kind, shell }) => el("div", { class: "banner", data: { testid: `banner-${kind}` } }, el("span"), el("small"), shell && !replaying() ? el("small", {}, "To stop: ", el("code", {}, "groundstation land")) : null, el("small", { class: "also" }))));
  }
  all.forEach(({ level, title, more, rank }, index) => {
    const node = host.children[index];
    node.className = `banner ${COLOURS[rank] ?? level}`;
    text(node.children[0], withShortNames(index && rank !== "notice" ? `${rank}: ${title}` : title));
    text(node.children[1], withShortNames(more ?? ""));
  });
  showLog();
  const first = host.firstElementChild, behind = all.slice(1);
  if (first) showAlso(first, behind.map(({ subject }) => subject).filter(Boolean).join(", "));
  showMore(behind.map(({ rank }) => rank), !first || fitted(first));
}

// The subjects of the other alarms, where they have room beside the first; tried anew only where the room may be another,
// or a screen reader would hear it with every beat.
function showAlso(banner, subjects) {
  const [title, more, also] = [banner.children[0], banner.children[1], banner.lastElementChild];
  const key = [title.textContent.length, more.textContent, subjects, innerWidth, document.body.className, byId("alarms").className].join();
  if (banner.dataset.also === key) return;
  banner.dataset.also = key;
  if (subjects) byId("more").hidden = false; // it takes some of the room
  text(also, subjects && withShortNames(`Also: ${subjects}`));
  if (!fitted(banner)) text(also, "");
}

// Fits an alarm into the strip's height, which is its least, in smaller letters if need be; returns whether it does.
function fitted(banner) {
  const fits = () => banner.offsetHeight <= Math.ceil(parseFloat(getComputedStyle(banner).minHeight));
  banner.classList.remove("long");
  if (!fits()) banner.classList.add("long");
  return fits();
}

// For tests: how late the page was to say that something is silent.
function noteSilence(kinds, before, ages) {
  for (const [kind, afterS] of Object.entries(ages)) if (kinds.includes(kind) && !before.includes(kind)) drawn.marks[kind] = { afterS, gapS: drawn.gapS };
}
