// The server's time, bounded from both sides: no frame is of the future, and no question was heard before it was sent. So
// a frame that was long on its way never looks new. Each bound loosens by what the two clocks may differ in their rates.

import { moment, sinceMs } from "./clock.js";

const DRIFT = 5e-4, ASKED = 64;
// The page's two clocks are read one after the other, and one of them in whole milliseconds.
const SLACK_MS = 20;
let frame = null, earliest = null, latest = null, asked = [], roundTrip = 0;

const grown = ({ serverMs, at }, drift) => serverMs + sinceMs(at) * (1 + drift);

// The server's time now, at the earliest and at the latest.
export const earliestMs = () => (earliest ? grown(earliest, -DRIFT) : performance.now());
export const latestMs = () => (latest ? Math.max(grown(latest, DRIFT), earliestMs()) : earliestMs());
// How long the newest answer took.
export const roundTripMs = () => roundTrip;

const contradict = () => Boolean(earliest && latest) && earliestMs() > grown(latest, DRIFT) + SLACK_MS;

// For a new connection: the server may be another one.
export function startClock() {
  [frame, earliest, latest, asked, roundTrip] = [null, null, null, [], 0];
}

// Returns the page's time of a message that the server is to answer.
export function asking() {
  asked = [...asked, moment()].slice(-ASKED);
  return asked.at(-1).steady;
}

// The server has sent a frame at this time of its own.
export function noteFrame(serverMs) {
  frame = { serverMs, at: moment() };
  if (!earliest || serverMs >= earliestMs()) earliest = frame;
  // One of the bounds is wrong: a clock was set, or stood still. The next answer shows which.
  if (contradict()) latest = null;
}

// The server had the page's message of the first time at the second, its own.
export function noteAnswer(sentMs, serverMs) {
  const index = asked.findIndex(({ steady }) => steady === sentMs);
  if (index < 0) return;
  const told = { serverMs, at: asked[index] };
  asked = asked.slice(index + 1);
  roundTrip = sinceMs(told.at);
  if (!latest || grown(told, 0) <= grown(latest, DRIFT)) latest = told;
  if (contradict()) earliest = frame;
}
