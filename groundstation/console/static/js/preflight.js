// The findings of the checks before a take-off, graded, with remedies; and those that forbid a take-off.

import { byId, el, text } from "./dom.js";
import { aloft } from "./glance.js";
import { droneNames, replaying, runOver, shownAgeS, store } from "./store.js";

const OLD_S = 10; // told again every 3 s
const SHORT = 12; // letters of a name that has room on a button

const findings = () => store.s.preflight?.findings ?? [];
const isTold = () => !runOver() && !aloft() && (replaying() || shownAgeS(store.s.preflight?.at) < OLD_S);
const graded = (level) => findings().filter((one) => one.level === level);

// The findings that forbid a take-off of these drones: those about other drones do not.
export function openMusts(names = droneNames()) {
  const others = droneNames().filter((name) => !names.includes(name));
  return isTold() ? graded("MUST").filter(({ subject }) => !others.includes(subject)) : [];
}

// Whether the last checks forbade its take-off: in the air they are made anew when it is ordered.
export const wasForbidden = (name) => graded("MUST").some(({ subject }) => subject === name);

// Why these may not take off: [in few words, in more]; null if they may.
export function forbidden(names) {
  const [first] = openMusts(names);
  if (!first) return null;
  return [`mend first: ${first.subject.length > SHORT ? "see list" : first.subject}`, `${mustWords(first)} → ${first.remedy}`];
}

export const mustWords = ({ subject, found }) => `${subject}: ${found}`;

const line = ({ level, subject, found, remedy }) => el("li", { class: level },
  el("b", { class: "level" }, level.toLowerCase()), el("span", {}, el("b", {}, subject), ` ${found}`, remedy ? el("small", {}, `→ ${remedy}`) : null));

export function showPreflight() {
  byId("preflight").hidden = !findings().length || !isTold();
  byId("anyway").hidden = replaying() || !openMusts().length;
  const musts = graded("MUST"), should = graded("SHOULD"), well = graded("OK"), key = JSON.stringify(findings());
  const host = byId("findings");
  if (host.dataset.key === key) return;
  host.dataset.key = key;
  text(byId("findings-sum"), `Before take-off: ${musts.length || "nothing"} must be mended, ${should.length || "nothing"} should`);
  host.replaceChildren(...[...musts, ...should].map(line));
  text(byId("well-sum"), `${well.length} ok`);
  byId("well").replaceChildren(...well.map(line));
}
