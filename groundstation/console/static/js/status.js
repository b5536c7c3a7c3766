// Is what you see true? The pills of the top bar, estimator health, events, processes.

import { byId, el, seconds, text } from "./dom.js";
import { drawn } from "./map.js";
import { ageS, consoleSilent, estimateAge, estimateOld, linkSlow, replaying, runOver, shownAgeS, store, trackerSilent } from "./store.js";

const OLD_S = 1;
let eventsShown = "";

export function showTop() {
  const link = byId("link"), silent = consoleSilent(), age = estimateAge();
  const [level, words] = store.s.ended ? ["calm", "run ended"] : !store.connected ? ["bad", "no connection"] : silent ? ["bad", "console silent"] : age === Infinity ? ["wait", "no estimate yet"] : trackerSilent() ? ["bad", "tracker silent"] : linkSlow() && estimateOld() ? ["bad", "slow link"] : ["good", replaying() ? "as it was" : "live"];
  link.dataset.level = level;
  text(link, words);
  const latencies = [...drawn.latencies].sort((a, b) => a - b), middle = latencies[latencies.length >> 1];
  text(byId("clock"), level === "good" && replaying() ? "" : level === "good" && middle !== undefined ? `${(middle / 1000).toFixed(2)} s behind` : Number.isFinite(age) ? `${seconds(age)} old` : "");
}

export function showHealth() {
  const health = store.s.health, pill = byId("nis");
  if (!health || health.nis === null) { text(pill, health ? "no innovations yet" : ""); delete pill.dataset.level; return; }
  const good = health.nis >= health.low && health.nis <= health.high, far = health.nis > 2 * health.high;
  pill.className = "pill num";
  // The last figures of a silent tracker say nothing of its present state.
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
  const total = processes.reduce((sum, [, status]) => sum + (shownAgeS(status.at) < 3 ? status.cpu : 0), 0);
  const host = byId("processes"), over = runOver();
  const key = JSON.stringify([over, processes.map(([name, { cpu, state, late, at }]) => [name, cpu, state, late, shownAgeS(at) > 3])]);
  if (host.dataset.key === key) return;
  host.dataset.key = key;
  host.replaceChildren(...processes.map(([name, status]) => {
    const silent = shownAgeS(status.at) > 3 && status.state !== "STOPPING";
    const level = over ? "wait" : silent ? "bad" : status.state === "DEGRADED" ? "warn" : status.state === "READY" ? "good" : "wait";
    const late = status.late > 0.01 ? ` · ${(100 * status.late).toFixed(0)} % late` : "";
    return el("span", { class: "pill num", title: status.detail, data: { level } }, `${name} ${over ? "ended" : silent ? "silent" : `${(100 * status.cpu).toFixed(0)} %${late}`}`);
  }), el("span", { class: "pill plain num" }, `together ${total.toFixed(2)} cores`));
}
