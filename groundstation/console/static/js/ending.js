// The result of the run. The page keeps the report itself: it is read long after the console has gone.

import { byId, el } from "./dom.js";
import { send } from "./link.js";
import { replaying, store } from "./store.js";

const WORDS = { passed: "PASSED", failed: "FAILED", invalid: "INVALID: its figures cannot be trusted", "not flown": "NOT FLOWN: no drone took off, so nothing is judged" };
let kept = "", keptFor = "";

const result = () => (replaying() ? undefined : store.s.result);
// The result in the strip of alarms; "" until the run is judged.
export const resultWords = () => WORDS[result()?.verdict] ?? "";

// Fetches the report once, and tells the console that it may go.
export async function keepEnd() {
  const end = result();
  if (!end || keptFor === end.folder) return;
  keptFor = end.folder;
  if (kept) URL.revokeObjectURL(kept);
  kept = end.report ? await fetched(end.report) : "";
  send("kept");
  showEnd();
}

async function fetched(path) {
  try {
    const answer = await fetch(path, { cache: "no-store" });
    return answer.ok ? URL.createObjectURL(await answer.blob()) : "";
  } catch { return ""; /* the folder and the command are shown all the same */ }
}

export function showEnd() {
  const end = result(), host = byId("ending");
  host.hidden = !end;
  const key = JSON.stringify([end, kept]);
  if (host.hidden || host.dataset.key === key) return;
  host.dataset.key = key;
  host.replaceChildren(...[
    el("h2", {}, "The run is over"),
    el("p", { class: "came-to", data: { testid: "result", verdict: end.verdict } }, WORDS[end.verdict] ?? "Not judged: no report was written"),
    end.reasons.length ? el("ul", { data: { testid: "reasons" } }, ...end.reasons.map((reason) => el("li", {}, reason))) : null,
    kept ? el("p", {}, el("a", { href: kept, target: "_blank", data: { testid: "report-link" } }, "Open the report"), " ", el("a", { href: kept, download: `${end.name}-report.html` }, "save it")) : null,
    end.command ? el("p", {}, "Fly again: ", el("code", { data: { testid: "fly-again" } }, end.command)) : null,
    el("p", { class: "dim" }, "Everything of this run: ", el("code", {}, end.folder)),
  ].filter(Boolean));
}
