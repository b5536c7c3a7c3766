// The one state of the page: the newest of each section, the server's time, trails and curves.

import { moment, sinceMs } from "./clock.js";

const TRAIL_POINTS = 300, SAMPLES = 240;
const OFFSET_WINDOW_MS = 30000;

export const store = {
  scene: null, s: {}, run: document.querySelector("meta[name=run]").content, seq: 0, frames: 0, seeds: 0,
  trails: {}, samples: [], receivedAt: -Infinity, serverMs: 0, connected: false,
};

let offsets = [], heard = moment();

// The greatest difference seen is the one with the least delay: sent and received at nearly the same time.
function noteClock(serverMs) {
  const at = performance.now();
  store.serverMs = serverMs;
  heard = moment();
  offsets.push([at, serverMs - at]);
  offsets = offsets.filter(([when]) => at - when < OFFSET_WINDOW_MS);
  store.offset = Math.max(...offsets.map(([, offset]) => offset));
  store.receivedAt = at;
}

export const replaying = () => Boolean(store.scene?.replay);
// Announced by the run itself; while drones may still be in the air, buttons stay for as long as somebody can obey them.
export const runOver = () => Boolean(store.s.ended) && (store.s.ended.severity === "INFO" || store.s.ended.closed || !store.connected);
export const steerable = () => Boolean(store.scene?.truth) && !replaying();
// A drone may be called as something that every object has, "constructor" say: a table by names holds these names only.
function onlyNames(table) {
  if (table === null || typeof table !== "object" || Array.isArray(table)) return table;
  Object.values(table).forEach(onlyNames);
  return Object.setPrototypeOf(table, null);
}

// A replay's time stands still, runs and jumps: it is what the newest frame says.
export const now = () => held ?? (replaying() ? store.serverMs : performance.now() + (store.offset ?? 0));
let held = null;
// Values shown together are of one time: else a drone falls silent between the bar and its card.
export function atOneTime(show) {
  held = now();
  try { show(); } finally { held = null; }
}
// The same for what is sent, right also before the first frame after a sleep.
export const serverNow = () => Math.max(now(), store.serverMs + sinceMs(heard));
export const ageS = (atMs) => (atMs === undefined || atMs === null ? Infinity : Math.max(0, (now() - atMs) / 1000));
export const silentS = () => (performance.now() - store.receivedAt) / 1000;

export function takeSeed(seed) {
  offsets = [];
  noteClock(seed.now);
  onlyNames(seed);
  Object.assign(store, { scene: seed.scene, s: seed.s, run: seed.run, seq: seed.seq });
  store.trails = seed.history.trails;
  store.samples = seed.history.samples;
  store.seeds += 1;
}

export function takeDelta(delta) {
  noteClock(delta.now);
  store.seq = delta.seq;
  store.frames += 1;
  Object.assign(store.s, onlyNames(delta.s));
  for (const [name, x, y] of delta.s.points ?? []) {
    const trail = (store.trails[name] ??= []);
    trail.push([x, y]);
    if (trail.length > TRAIL_POINTS) trail.shift();
  }
  store.samples.push(...(delta.s.samples ?? []));
  store.samples.splice(0, Math.max(0, store.samples.length - SAMPLES));
  return Boolean(delta.s.samples);
}

export const entities = () => store.s.estimate?.entities ?? [];
export const entity = (name) => entities().find((candidate) => candidate.name === name);
export const estimateAge = () => ageS(store.s.estimate?.at);
const TRACKER_S = 0.5, CONSOLE_S = 0.8;
export const consoleSilent = () => silentS() > CONSOLE_S;
// It was heard once, and is not any more.
export const trackerSilent = () => Number.isFinite(estimateAge()) && estimateAge() > TRACKER_S;
export const isTarget = (name) => (store.scene?.targets ?? []).some((target) => target.name === name);
// Footprints are drawn at one height: that of the highest target's marker.
export const targetHeight = () => Math.max(0, ...(store.scene?.targets ?? []).map((target) => target.height_m));
export const droneNames = () => (store.scene?.drones ?? []).map((drone) => drone.name);
// Time since an observation of a body corrected the belief; for one not in the belief, since it was in a picture.
export function unseenS(name) {
  const body = entity(name), pictures = (store.s.sightings ?? []).filter(([, subject]) => subject === name);
  return body ? body.age_s + estimateAge() : Math.min(...pictures.map(([, , at]) => ageS(at)), Infinity);
}
// What is unseen for longer was never seen: no infinite age comes through JSON.
export const NEVER_S = 1e5;
export const SEEN_S = 1;
const inSight = (name) => (store.s.sightings ?? []).filter(([, subject, at]) => subject === name && ageS(at) < SEEN_S);
export const seenBy = (name) => inSight(name).map(([observer]) => observer);
export const isSeen = (observer, subject) => inSight(subject).some(([one]) => one === observer);
