// Is what you see true? Banners, the pills of the top bar, estimator health, events, processes.

import { showLog, showMore } from "./alarm_strip.js";
import { byId, el, seconds, text } from "./dom.js";
import { unheardStop } from "./effects.js";
import { resultWords } from "./ending.js";
import { drawn } from "./map.js";
import { ageS, estimateAge, replaying, runOver, silentS, store, trackerSilent } from "./store.js";
import { calm } from "./verdict.js";

const SILENT_S = 0.8, OLD_S = 1;
const notices = [];
let eventsShown = "";

export function addNotice({ text: words, grave }) {
  notices.push({ words, grave, at: performance.now() });
  if (notices.length > 3) notices.shift();
}

export function showBanners() {
  const banners = [];
  const age = estimateAge(), ageWords = Number.isFinite(age) ? `What you see is ${seconds(age)} old.` : "";
  const ended = store.s.ended;
  if (ended) banners.push(["ended", ended.severity === "INFO" ? "calm" : "grave", [ended.text[0].toUpperCase() + ended.text.slice(1), resultWords()].filter(Boolean).join(". "), runOver() ? "The stop buttons are off: this run takes no more orders." : "", ended.severity !== "INFO"]);
  else if (!store.connected) banners.push(["link", "grave", "NO CONNECTION TO THE CONSOLE", `${store.reason ? `${store.reason}. ` : ""}${ageWords}`, true]);
  else if (silentS() > SILENT_S) banners.push(["silent", "grave", `CONSOLE SILENT for ${seconds(silentS())}`, ageWords, true]);
  else if (trackerSilent()) banners.push(["tracker", "grave", `TRACKER SILENT for ${seconds(age)}`, "Nothing to do: drones hover, and land 3 s after its last word. Positions are old; LAND ALL works without it."]);
  const stop = store.connected ? unheardStop() : null;
  if (stop) banners.push(["unheard", "grave", `${stop.verb} NOT CONFIRMED: no answer from ${stop.names}`, "Press again. What flies on: groundstation land in a shell, or its own remote control."]);
  for (const notice of notices.filter(({ at }) => performance.now() - at < 8000)) banners.push(["notice", notice.grave ? "grave" : "mild", notice.words, ""]);
  for (const alarm of store.connected && !ended ? (store.s.alarms ?? []).slice(0, 4) : []) {
    if (!alarm.text.startsWith("tracker: no estimate")) banners.push(["alarm", alarm.grave ? "grave" : "mild", alarm.text, alarm.advice]);
  }
  if (!banners.length && !replaying()) banners.push([...calm(), ""]);
  banners.sort(([, a], [, b]) => (b === "grave") - (a === "grave"));
  const host = byId("banners"), kinds = banners.map(([kind]) => kind).join();
  if (host.dataset.kinds !== kinds) {
    noteSilence(kinds.split(","), (host.dataset.kinds ?? "").split(","), { tracker: age, silent: silentS() });
    host.dataset.kinds = kinds;
    host.replaceChildren(...banners.map(([kind, , , , shell]) => el("div", { class: "banner", data: { testid: `banner-${kind}` } }, el("span"), el("small"), shell && !replaying() ? el("small", {}, "To stop without this page: ", el("code", {}, "groundstation land")) : null)));
  }
  banners.forEach((banner, index) => {
    const [, level, title, more] = banner;
    const node = host.children[index];
    node.className = `banner ${level}`;
    text(node.children[0], `${LEADS[rank(banner)] ?? ""}${title}`);
    text(node.children[1], more);
  });
  showLog();
  showMore(banners.slice(1).map(rank), !host.firstElementChild || fitted(host.firstElementChild));
}

// Fits an alarm into the strip's height, which is its least, in smaller letters if need be; returns whether it does.
function fitted(banner) {
  const fits = () => banner.offsetHeight <= Math.ceil(parseFloat(getComputedStyle(banner).minHeight));
  banner.classList.remove("long");
  if (!fits()) banner.classList.add("long");
  return fits();
}

// As alerting systems have it, a warning needs an act, a caution attention; a notice answers a press.
const rank = ([kind, level]) => (level === "grave" ? "warning" : level === "mild" && kind !== "notice" ? "caution" : "notice");
const LEADS = { warning: "⚠ WARNING: ", caution: "CAUTION: " };

// For tests: how late the page was to say that something is silent.
function noteSilence(kinds, before, ages) {
  for (const [kind, afterS] of Object.entries(ages)) if (kinds.includes(kind) && !before.includes(kind)) drawn.marks[kind] = { afterS, gapS: drawn.gapS };
}

export function showTop() {
  const link = byId("link"), silent = silentS() > SILENT_S, age = estimateAge();
  const [level, words] = store.s.ended ? ["calm", "run ended"] : !store.connected ? ["bad", "no connection"] : silent ? ["bad", "console silent"] : age === Infinity ? ["wait", "waiting for the tracker"] : trackerSilent() ? ["bad", "tracker silent"] : ["good", replaying() ? "as it was" : "live"];
  link.dataset.level = level;
  text(link, words);
  const latencies = [...drawn.latencies].sort((a, b) => a - b), middle = latencies[latencies.length >> 1];
  text(byId("clock"), level === "good" && replaying() ? "" : level === "good" && middle !== undefined ? `${middle.toFixed(0)} ms` : Number.isFinite(age) ? `${seconds(age)} old` : "");
}

export function showHealth() {
  const health = store.s.health, pill = byId("nis");
  if (!health || health.nis === null) { text(pill, health ? "no innovations yet" : ""); delete pill.dataset.level; return; }
  const good = health.nis >= health.low && health.nis <= health.high, far = health.nis > 2 * health.high;
  pill.className = "pill num";
  // What a silent tracker was like says nothing of what it is like.
  pill.dataset.level = estimateAge() > OLD_S ? "wait" : good ? "good" : far ? "bad" : "warn";
  text(pill, `${estimateAge() > OLD_S ? "was: " : ""}NIS ${health.nis.toFixed(2)} ${good ? "consistent" : health.nis > health.high ? "overconfident" : "cautious"} · ${(100 * (health.accepted ?? 0)).toFixed(0)} % accepted`);
  pill.title = `95 % bounds ${health.low.toFixed(2)} to ${health.high.toFixed(2)}`;
  if (!byId("edges").parentElement.open) return;
  byId("edges").replaceChildren(el("table", {}, el("tr", {}, ...["edge", "NIS", "95 % bounds", "accepted", "last refused"].map((title) => el("th", {}, title))),
    ...health.edges.map((edge) => el("tr", {}, el("td", {}, `${edge.observer} → ${edge.subject}`), el("td", {}, edge.nis === null ? "–" : edge.nis.toFixed(2)),
      el("td", {}, edge.low === null ? "–" : `${edge.low.toFixed(2)}…${edge.high.toFixed(2)}`), el("td", {}, edge.accepted === null ? "–" : `${(100 * edge.accepted).toFixed(0)} %`), el("td", {}, edge.refused)))));
}

export function showEvents() {
  const events = store.s.events ?? [], key = `${events.length}:${events.at(-1)?.at}:${events[0]?.at}`;
  const host = byId("events");
  if (key !== eventsShown) {
    eventsShown = key;
    host.replaceChildren(...[...events].reverse().map((event) => el("li", { class: event.severity }, el("time", { class: "dim num", data: { at: event.at } }), el("span", { class: "mark" }, event.severity.toLowerCase()),
      el("span", {}, event.text.startsWith(event.entity) ? event.text : `${event.entity}: ${event.text}`, event.remedy ? el("small", {}, event.remedy) : null))));
  }
  for (const node of host.querySelectorAll("time")) text(node, `${seconds(ageS(Number(node.dataset.at)))} ago`);
}

export function showProcesses() {
  const processes = Object.entries(store.s.processes ?? {}).sort(([a], [b]) => a.localeCompare(b));
  const total = processes.reduce((sum, [, status]) => sum + (ageS(status.at) < 3 ? status.cpu : 0), 0);
  const host = byId("processes"), over = runOver();
  const key = JSON.stringify([over, processes.map(([name, { cpu, state, late, at }]) => [name, cpu, state, late, ageS(at) > 3])]);
  if (host.dataset.key === key) return;
  host.dataset.key = key;
  host.replaceChildren(...processes.map(([name, status]) => {
    const silent = ageS(status.at) > 3 && status.state !== "STOPPING";
    const level = over ? "wait" : silent ? "bad" : status.state === "DEGRADED" ? "warn" : status.state === "READY" ? "good" : "wait";
    const late = status.late > 0.01 ? ` · ${(100 * status.late).toFixed(0)} % late` : "";
    return el("span", { class: "pill num", title: status.detail, data: { level } }, `${name} ${over ? "ended" : silent ? "silent" : `${(100 * status.cpu).toFixed(0)} %${late}`}`);
  }), el("span", { class: "pill plain num" }, `together ${total.toFixed(2)} cores`));
}
