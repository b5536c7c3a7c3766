// The one state of the page: the newest of each section, the server's time, trails and curves.

import { latestMs, noteFrame } from "./server_clock.js";

const TRAIL_POINTS = 300, SAMPLES = 240;
// A frame older than this when it comes is late: the link is slow, or this device is.
const LATE_MS = 400;

export const store = {
  scene: null, s: {}, run: document.querySelector("meta[name=run]").content, seq: 0, frames: 0, seeds: 0,
  trails: {}, samples: [], receivedAt: -Infinity, serverMs: 0, connected: false,
};

let lateSince = null;

function noteClock(serverMs) {
  store.serverMs = serverMs;
  store.receivedAt = performance.now();
  noteFrame(serverMs);
  lateSince = latestMs() - serverMs > LATE_MS ? lateSince ?? store.receivedAt : null;
}

export const replaying = () => Boolean(store.scene?.replay);
// Announced by the run itself; while drones may still be in the air, buttons stay for as long as somebody can obey them.
export const runOver = () => Boolean(store.s.ended) && ((store.s.ended.severity === "INFO" && store.s.ended.down) || store.s.ended.closed || !store.connected);
export const steerable = () => Boolean(store.scene?.truth) && !replaying();
// A drone may be called as something that every object has, "constructor" say: a table by names holds these names only.
function onlyNames(table) {
  if (table === null || typeof table !== "object" || Array.isArray(table)) return table;
  Object.values(table).forEach(onlyNames);
  return Object.setPrototypeOf(table, null);
}

// The server's time, at the latest. A replay's stands still, runs and jumps: it is what the newest frame says.
export const now = () => held ?? (replaying() ? store.serverMs : latestMs());
let held = null;
// Values shown together are of one time: else a drone falls silent between the bar and its card.
export function atOneTime(show) {
  held = now();
  try { show(); } finally { held = null; }
}
const since = (atMs, then) => (atMs === undefined || atMs === null ? Infinity : Math.max(0, (then - atMs) / 1000));
export const ageS = (atMs) => since(atMs, now());
export const silentS = () => (performance.now() - store.receivedAt) / 1000;
// Whether frames come late, and for how long they have [s].
export const linkSlow = () => store.connected && !replaying() && lateSince !== null;
export const slowForS = () => (linkSlow() ? (performance.now() - lateSince) / 1000 : 0);
export const frameAgeS = () => ageS(store.serverMs);
// The age that something had when the newest frame was sent, while frames come late: that a drone or the tracker is
// silent, or a body unseen, cannot be told from a slow link.
export const shownAgeS = (atMs) => since(atMs, linkSlow() ? store.serverMs : now());
export const lagS = () => (linkSlow() ? frameAgeS() : 0);

export function takeSeed(seed) {
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

const estimated = () => store.s.estimate?.entities ?? [];
export const entity = (name) => estimated().find((candidate) => candidate.name === name);
// All but targets that may be anywhere: those have no place to show.
export const entities = () => estimated().filter(({ anywhere }) => !anywhere);
export const placed = (name) => entities().find((candidate) => candidate.name === name);
export const estimateAge = () => ageS(store.s.estimate?.at);
export const shownEstimateAge = () => shownAgeS(store.s.estimate?.at);
const TRACKER_S = 0.5, CONSOLE_S = 0.8;
export const consoleSilent = () => silentS() > CONSOLE_S && !linkSlow();
// It was heard once, and is not any more.
const isOld = (age) => Number.isFinite(age) && age > TRACKER_S;
export const trackerSilent = () => isOld(shownEstimateAge());
// Whatever the reason.
export const estimateOld = () => isOld(estimateAge());
export const isTarget = (name) => (store.scene?.targets ?? []).some((target) => target.name === name);
// Footprints are drawn at one height: that of the highest target's marker.
export const targetHeight = () => Math.max(0, ...(store.scene?.targets ?? []).map((target) => target.height_m));
export const droneNames = () => (store.scene?.drones ?? []).map((drone) => drone.name);
// Time since an observation of a body corrected the belief; for one not in the belief, since it was in a picture.
export function unseenS(name) {
  const body = entity(name), pictures = (store.s.sightings ?? []).filter(([, subject]) => subject === name);
  return body ? body.age_s + shownEstimateAge() : Math.min(...pictures.map(([, , at]) => shownAgeS(at)), Infinity);
}
// What is unseen for longer was never seen: no infinite age comes through JSON.
export const NEVER_S = 1e5;
export const SEEN_S = 1;
const inSight = (name) => (store.s.sightings ?? []).filter(([, subject, at]) => subject === name && shownAgeS(at) < SEEN_S);
export const seenBy = (name) => inSight(name).map(([observer]) => observer);
export const isSeen = (observer, subject) => inSight(subject).some(([one]) => one === observer);
