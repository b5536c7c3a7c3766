// Orders that this page gave and that the server has not shown yet, so that none is silently lost on the way there.

import { moment, pressedAgoMs, sinceMs } from "./clock.js";
import { STOPS } from "./effects.js";
import { me, on, send } from "./link.js";
import { earliestMs, latestMs } from "./server_clock.js";
import { droneNames, now, replaying, runOver, store } from "./store.js";

const KEPT_MS = 30000, STOP_LIVES_MS = 5000, SAME_PRESS_MS = 1000;
export const OVER = "the run has ended: no order can be given any more";
// What becomes of a stop that waits for the connection when it has waited for too long. A doubtful one was handed to a
// connection that broke: it may have been heard.
const AFTER_WAITING = { unsent: "dropped", doubtful: "lost" };
// No other load of a page names an order so: a duplicated tab has the same client, and a reload counts from 1 again.
const load = [...crypto.getRandomValues(new Uint8Array(6))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
let own = [], count = 0, started = null, changed = () => {};

// The server refuses the rest as well: a page of another make may ask for more.
export const mayGive = (verb) => me.role === "command" || (me.role === "stop" && STOPS.has(verb));
// Whether this page is the operator's, or nobody's is.
export const mayOperate = () => [undefined, "", me.name].includes(store.s.session?.operator);
export const roleText = () => `this device may ${me.role} only`;
const inShell = (verb) => `groundstation ${verb.toLowerCase().replace("_", "-")} in a shell`;
const put = (order, state, note = "") => Object.assign(order, { state, note, since: moment() });
const waits = ({ state }) => state in AFTER_WAITING;
const meanwhile = (verb) => `if the connection is back within ${STOP_LIVES_MS / 1000} s. Now: ${inShell(verb)}`;

// run: the one that the operator meant, which while a button is held may have given way to the next. anyway: against
// the checks before a take-off.
export function give(verb, drones = [], run = store.run, anyway = false) {
  if (replaying()) return; // the server would refuse it as well
  const agoMs = pressedAgoMs(), given = moment(agoMs);
  if (isSamePress(verb, drones, given)) return;
  const order = { ref: `${load}-${++count}`, verb, drones, run, anyway, given, given_ms: now() - agoMs };
  own.push(order);
  begin(order);
  if (order.state === "sent" && !STOPS.has(verb)) started = order;
  changed();
}

// The second click of a double click: a start given twice may do more than one, as after an emergency.
const isSamePress = (verb, drones, given) => started?.verb === verb && `${started.drones}` === `${drones}` && sinceMs(started.given) - sinceMs(given) < SAME_PRESS_MS;

function begin(order) {
  if (!mayGive(order.verb)) return put(order, "refused", roleText());
  put(order, "unsent", `no connection: it is sent ${meanwhile(order.verb)}`);
  if (runOver()) put(order, "dropped", OVER);
  else if (order.run === store.run && transmit(order)) put(order, "sent");
  else if (!STOPS.has(order.verb)) put(order, "dropped", "no connection");
}

function transmit({ verb, drones, run, anyway, ref, given }) {
  const age_ms = sinceMs(given), at_ms = earliestMs() - age_ms;
  return me.greeted && send("order", { verb, drones, run, anyway, ref, age_ms, at_ms, unsure_ms: latestMs() - earliestMs() });
}

// A stop that did not get out is good for the run that it was given for, and for so long only.
function drop() {
  for (const order of own.filter(waits)) {
    const state = AFTER_WAITING[order.state];
    if (order.run !== store.run) put(order, state, "it was given for another run");
    else if (runOver()) put(order, state, OVER);
    else if (sinceMs(order.given) > STOP_LIVES_MS) put(order, state, `dropped: there was no connection for ${STOP_LIVES_MS / 1000} s. Give it again, or: ${inShell(order.verb)}`);
  }
}

function forgetShown() {
  const shown = new Set((store.s.orders ?? []).map(({ ref }) => ref).filter(Boolean));
  own = own.filter((order) => !shown.has(order.ref) && sinceMs(order.since) < KEPT_MS);
}

// The server may never have received a stop that it has not shown when the connection breaks.
function doubt() {
  for (const order of own) if (order.state === "sent" && STOPS.has(order.verb)) put(order, "doubtful", `the connection broke: it is sent again ${meanwhile(order.verb)}`);
}

function sendWaiting() {
  drop();
  for (const order of own.filter(waits)) if (transmit(order)) put(order, "sent", "sent once the connection was back");
}

function refuse({ ref, text: reason }) {
  const order = own.find((candidate) => ref && candidate.ref === ref);
  if (order) put(order, "refused", reason);
}

// show: what shows them, at once.
export function startOwnOrders(show) {
  changed = show;
  on("welcome", () => { sendWaiting(); show(); });
  on("state", () => { if (!store.connected) doubt(); show(); });
  on("notice", (notice) => { refuse(notice); show(); });
}

// As the server shows its orders, the newest first.
export function ownOrders() {
  drop();
  forgetShown();
  return own.map((order) => ({ ...order, rows: (order.drones.length ? order.drones : droneNames()).map((name) => ({ name })), by: "you", team: !order.drones.length })).reverse();
}
