// The lists behind the strip of alarms: the other lasting alarms, and past ones. Both open over the page, one at a time,
// so that nothing moves.

import { byId, el, text } from "./dom.js";
import { ownPast } from "./own_alarms.js";
import { momentWords } from "./playback.js";
import { store } from "./store.js";

// The action that an alarm asks for: its leading word, and the words to count such alarms with.
const RANKS = { ACT: "to act on", WATCH: "to watch", notice: "" };
let shown = "";

export function startStrip() {
  const log = byId("log");
  byId("more").onclick = () => openAlarms(!byId("alarms").classList.contains("open"));
  log.onclick = toggleLog;
  byId("alarms").addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    if (!byId("alarm-log").hidden) log.focus();
    openAlarms(false);
    openLog(false);
  });
  return toggleLog;
}

function openAlarms(open) {
  if (open) openLog(false);
  byId("alarms").classList.toggle("open", open);
  byId("more").setAttribute("aria-expanded", `${open}`);
}

function openLog(open) {
  if (open) openAlarms(false);
  byId("alarm-log").hidden = !open;
  byId("log").setAttribute("aria-expanded", `${open}`);
}

function toggleLog() {
  openLog(byId("alarm-log").hidden);
  showLog();
  if (!byId("alarm-log").hidden) byId("alarm-log").focus();
}

// All but the gravest alarm stand behind this button, counted by rank; the gravest as well, where it is too long to stand
// whole in its strip.
export function showMore(ranks, whole) {
  const more = byId("more");
  more.hidden = !ranks.length && whole;
  if (more.hidden) openAlarms(false);
  text(more, byId("alarms").classList.contains("open") ? "close" : ranks.length ? counted(ranks).join(", ") : "whole text");
}

function counted(ranks) {
  const counts = Object.keys(RANKS).map((rank) => [rank, ranks.filter((one) => one === rank).length]).filter(([, count]) => count);
  return counts.map(([rank, count]) => `${count}${counts.length > 1 && RANKS[rank] ? "" : " more"} ${RANKS[rank]}`.trim());
}

export function showLog() {
  const past = [...(store.s.past_alarms ?? []), ...ownPast()].sort((a, b) => b.began - a.began), button = byId("log"), host = byId("alarm-log"), key = JSON.stringify(past);
  text(button, host.hidden ? `Past alarms ${past.length || ""}`.trim() : "close");
  if (host.hidden || key === shown) return;
  shown = key;
  host.querySelector("ol").replaceChildren(...past.map(pastAlarm));
}

function pastAlarm({ text: words, asks, began, ended }) {
  const lasted = ((ended - began) / 1000).toFixed(0), rank = asks ? "ACT" : "WATCH";
  return el("li", { data: { rank } }, el("span", { class: "num" }, `${momentWords(began)} – ${momentWords(ended)}, ${lasted} s`),
    el("span", { class: "mark" }, rank), el("span", {}, words));
}
