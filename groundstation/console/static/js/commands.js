// Buttons and keys that command, and how far each order came.

import { moment, sinceMs } from "./clock.js";
import { byId, el, seconds, text } from "./dom.js";
import { effectOf, effectOnOne, isIdle, mayFail, refusalOf, startEffect } from "./effects.js";
import { me, send } from "./link.js";
import { give, mayGive, mayOperate, OVER, ownOrders, roleText, startOwnOrders } from "./own_orders.js";
import { forbidden } from "./preflight.js";
import { ageS, droneNames, replaying, runOver, store } from "./store.js";
import { askedBy, giver } from "./who.js";

const SHOWN = 5, PRESS_MS = 1000, ASLEEP_MS = 1000;
const WORDS = { TAKEOFF: "TAKE OFF", CUT_MOTORS: "CUT MOTORS" };
const STATES = {
  unsent: "NOT SENT", dropped: "NOT SENT", doubtful: "NOT CONFIRMED", lost: "NOT CONFIRMED", sent: "NOT CONFIRMED", heard: "acknowledged",
  confirmed: "✓ confirmed", refused: "REFUSED", not_confirmed: "NOT CONFIRMED",
};
const STAGES = { RECEIVED: "received", ACCEPTED: "accepted", EFFECTIVE: "✓ done" };

export function startOrders() {
  startOwnOrders(showOrders);
  byId("land").onclick = () => give("LAND");
  byId("hold").onclick = () => give("HOLD");
  byId("takeoff").onclick = () => give("TAKEOFF");
  byId("track").onclick = () => give("TRACK");
  byId("resume").onclick = () => give("RESUME");
  byId("takeover").onclick = () => send("takeover");
  holdToPress(byId("cut"), (run) => give("CUT_MOTORS", [], run));
  holdToPress(byId("anyway"), (run) => give("TAKEOFF", [], run, true));
}

// Fires after one second of pressing, by pointer or by key, for the run that was shown when it began; anything that ends
// it early ends it, and a page that slept has not seen whether anything did.
function holdToPress(button, fire) {
  let timer = 0;
  const stop = () => { clearTimeout(timer); timer = 0; button.classList.remove("held"); };
  const pressed = (run, began) => { stop(); if (sinceMs(began) < PRESS_MS + ASLEEP_MS) fire(run); };
  const start = () => {
    if (timer) return;
    button.classList.add("held");
    timer = setTimeout(pressed, PRESS_MS, store.run, moment());
  };
  for (const kind of ["freeze", "visibilitychange"]) document.addEventListener(kind, stop);
  button.addEventListener("pointerdown", (event) => { if (event.button === 0) { button.setPointerCapture(event.pointerId); start(); } });
  for (const kind of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) button.addEventListener(kind, stop);
  button.addEventListener("pointermove", (event) => {
    const box = button.getBoundingClientRect();
    if (event.clientX < box.left || event.clientX > box.right || event.clientY < box.top || event.clientY > box.bottom) stop();
  });
  button.addEventListener("keydown", (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); if (!event.repeat) start(); } });
  button.addEventListener("keyup", stop);
  button.addEventListener("contextmenu", (event) => event.preventDefault());
}

export function showControls() {
  showStops();
  const session = store.s.session ?? {}, replay = replaying(), mine = session.operator === me.name;
  text(byId("operator"), replay ? "" : !me.trusted ? "looking only" : !mayGive("TAKEOFF") ? roleText() : `${!session.operator ? "anyone" : mine ? "you" : session.operator} may start`);
  byId("takeover").hidden = replay || !me.trusted || !mayGive("TAKEOFF") || !session.operator || mine;
  showStarts(barred(session));
}

// A stop is never withheld while a run goes on; its caption says what it would do now, or that there is nothing to do.
function showStops() {
  for (const node of document.querySelectorAll("#land, #hold, #cut, [data-land], [data-hold]")) {
    node.dataset.title ??= node.title;
    node.disabled = replaying() || runOver() || !mayGive("LAND");
    node.title = runOver() ? OVER : !mayGive("LAND") ? roleText() : node.dataset.title;
  }
  for (const node of document.querySelectorAll("small[data-effect]")) {
    const { effect: verb, whom } = node.dataset, names = whom ? [whom] : droneNames();
    node.dataset.caption ??= node.textContent;
    const effect = runOver() ? "run over" : !store.connected ? "no connection" : whom ? effectOnOne(verb, whom) : effectOf(verb);
    text(node, effect || node.dataset.caption);
    node.closest("button").classList.toggle("idle", store.connected && !runOver() && isIdle(verb, names));
  }
}

// Why this page may start nothing now: [in few words, in more]; null if it may.
function barred(session) {
  if (replaying()) return ["a replay", "a replay: nothing here can be commanded"];
  if (runOver()) return ["run over", OVER];
  if (!store.connected) return ["no connection", "no connection"];
  if (!me.trusted) return ["looking only", "this page may only look"];
  if (!mayGive("TAKEOFF")) return [`may ${me.role} only`, roleText()];
  if (!mayOperate()) return ["another page may", "another page is the operator: take over first"];
  return session.lease ? null : ["station not in charge", "the ground station's main process may not give orders now"];
}

function showStarts(why) {
  for (const [id, verb] of [["takeoff", "TAKEOFF"], ["track", "TRACK"], ["resume", "RESUME"]]) {
    const button = byId(id), reason = why ?? startRefusal(verb);
    text(button.querySelector("small"), reason ? notNow(reason[0]) : startEffect(verb));
    enable(button, reason);
  }
  for (const node of document.querySelectorAll("[data-takeoff]")) {
    const reason = why ?? startRefusal("TAKEOFF", [node.dataset.takeoff]);
    enable(node, reason);
    text(node.querySelector("small"), reason ? inFewer(reason[0]) : mayFail(node.dataset.takeoff) ? "rises, if able" : "rises, hovers");
  }
  enable(byId("anyway"), why ?? twice(refusalOf("TAKEOFF")));
}

// So that no reason reads as an effect.
const SAYS_SO = /already$|instead$|first$|^mend|^check|^run over|only$|connection$|charge$|unknown$/;
const notNow = (words) => (SAYS_SO.test(words) ? words : `not now: ${words}`);

// Why one drone may not take off, where a card has less room.
const OF_ONE = {
  "another page may": "no: other page", "battery unknown": "no: battery?", "station not in charge": "not in charge", "not heard yet": "no: not heard",
};
const inFewer = (words) => OF_ONE[words] ?? (words.startsWith("mend") ? "mend: see list" : words.startsWith("check") ? "check it first" : SAYS_SO.test(words) ? words : `no: ${words}`);

const startRefusal = (verb, names = droneNames()) => twice(refusalOf(verb, names)) ?? (verb === "TAKEOFF" ? forbidden(names) : null);

const twice = (words) => (words ? [words, words] : null);

function enable(button, reason) {
  button.disabled = Boolean(reason);
  button.title = reason?.[1] ?? "";
}

export function showOrders() {
  const all = [...ownOrders(), ...(store.s.orders ?? [])].sort((a, b) => b.given_ms - a.given_ms).slice(0, SHOWN);
  // Rebuilt only when an order has come further: a screen reader reads what changes.
  const host = byId("orders"), key = JSON.stringify(all.map(({ id, ref, state, rows, note }) => [id, ref, state, rows, note]));
  if (host.dataset.key !== key) {
    host.dataset.key = key;
    host.replaceChildren(...all.map(line));
  }
  all.forEach((order, index) => {
    const age = ageS(order.given_ms);
    host.children[index].classList.toggle("old", age > 20);
    text(host.children[index].querySelector(".ago"), `${seconds(age)} ago`);
  });
}

function line(order) {
  const asker = askedBy(order), scope = order.team ? "all" : order.rows.map((row) => row.name).join(", ");
  return el("li", { class: "order", data: { state: order.state, verb: order.verb, testid: "order" } },
    el("div", { class: "head" },
      el("span", {}, `${WORDS[order.verb] ?? order.verb} `, el("small", {}, `${scope} · ${asker ? `passed on for ${giver(asker)}` : giver(order.by)} · `, el("span", { class: "ago num", "aria-hidden": "true" }))),
      el("span", { class: "state" }, STATES[order.state] ?? order.state)),
    el("div", { class: "rows" }, ...order.rows.map((row) => el("span", {}, el("b", {}, `${row.name} `), el("span", { class: row.stage && row.stage !== "REFUSED" ? "" : "missing" }, stage(row, order)))),
      order.note ? el("span", { class: "missing" }, order.note) : null));
}

function stage(row, order) {
  if (!row.stage) return ["unsent", "dropped"].includes(order.state) ? "not sent" : order.state === "refused" ? "—" : "no answer";
  if (row.stage === "REFUSED") return `refused: ${row.reason}`;
  return row.instead ? `${STAGES[row.stage]}, not done: ${row.instead}` : STAGES[row.stage];
}
