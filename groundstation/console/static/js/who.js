// The giver of an order, in words for a person: this page's viewer is "you", the run's own program is its terminal.

import { me } from "./link.js";
import { store } from "./store.js";

const TERMINAL = "operator";

export const giver = (by) => (by === me.name ? "you" : by === TERMINAL ? "the run's terminal" : by);

// For how long the terminal may carry out a start that a page asked it for: it lifts drones one after the other [ms].
const ASKED_MS = { TAKEOFF: 60000, TRACK: 3000, RESUME: 3000 };

// The viewer that asked the terminal for its order; "" if none did.
export function askedBy({ by, verb, given_ms: at }) {
  const asks = (one) => one.by !== TERMINAL && one.verb === verb && one.given_ms <= at && at - one.given_ms < (ASKED_MS[verb] ?? 0);
  return by === TERMINAL ? (store.s.orders ?? []).find(asks)?.by ?? "" : "";
}

export const ordered = (by) => (by === TERMINAL ? "ordered at the terminal" : `ordered by ${giver(by)}`);
