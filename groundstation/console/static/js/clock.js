// Time since a moment. Of two clocks the one that says more: performance.now() may stand still while the machine
// sleeps, and Date.now() may be set back.

export const moment = (agoMs = 0) => ({ steady: performance.now() - agoMs, wall: Date.now() - agoMs });
export const sinceMs = (then) => Math.max(performance.now() - then.steady, Date.now() - then.wall);

const BEAT_MS = 250, FROZEN_MS = 1000;
let beat = moment(), thaw = { frozenMs: 0, at: beat };

setInterval(() => {
  const ms = sinceMs(beat);
  beat = moment();
  if (ms > FROZEN_MS) thaw = { frozenMs: ms, at: beat };
}, BEAT_MS);

// How long ago what is being handled was pressed: a frozen page hears of a press when it goes on. Believed no further than
// the page itself knows that it stood still, since some browsers reckon the time of a press by another clock.
export function pressedAgoMs() {
  const stood = Math.max(sinceMs(beat), sinceMs(thaw.at) < FROZEN_MS ? thaw.frozenMs + sinceMs(thaw.at) : 0);
  const pressed = performance.now() - (window.event?.timeStamp ?? performance.now());
  return stood > FROZEN_MS ? Math.max(0, Math.min(stood, pressed)) : 0;
}
