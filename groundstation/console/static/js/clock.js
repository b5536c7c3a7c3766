// Time since a moment. Of two clocks the one that says more: performance.now() may stand still while the machine
// sleeps, and Date.now() may be set back.

export const moment = () => ({ steady: performance.now(), wall: Date.now() });
export const sinceMs = (then) => Math.max(performance.now() - then.steady, Date.now() - then.wall);
