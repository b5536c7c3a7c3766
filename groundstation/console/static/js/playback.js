// The knobs of a replay: play, step, seek, speed, by pointer and by key; all viewers share them.

import { byId, el, text } from "./dom.js";
import { send } from "./link.js";
import { now, replaying, store } from "./store.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20];
const SEEK_EVERY_MS = 100, JUMP_MS = 5000, HELD_EVERY_MS = 50;
const PRESS = new Set([" ", "Enter"]), MOVE = new Set(["ArrowLeft", "ArrowRight", "Home", "End"]);
let dragging = false, sentAt = 0, later = 0, actedAt = -Infinity;

const replay = () => store.scene.replay;
const playback = () => store.s.playback ?? { at_ms: replay().start_ms, playing: false, speed: 1, ended: false };

export function startPlayback() {
  const bar = byId("playback");
  bar.hidden = !replay();
  if (!replay()) return;
  const { start_ms: start, end_ms: end, name, what, marks } = replay();
  text(byId("replay-badge"), what);
  text(byId("replay-name"), name);
  const reel = byId("reel");
  Object.assign(reel, { min: 0, max: Math.ceil(end - start), step: 10 });
  reel.oninput = () => { dragging = true; seekSoon(start + Number(reel.value)); showTime(Number(reel.value)); };
  reel.onchange = () => { dragging = false; seek(start + Number(reel.value)); };
  reel.onblur = () => { dragging = false; };
  byId("play").onclick = toggle;
  byId("step-back").onclick = () => send("step", { ticks: -1 });
  byId("step-on").onclick = () => send("step", { ticks: 1 });
  const speed = byId("speed");
  speed.replaceChildren(...SPEEDS.map((factor) => el("option", { value: factor }, `${factor} ×`)));
  speed.onchange = () => send("speed", { factor: Number(speed.value) });
  // Loud ones last, so that they lie on top.
  const rank = { INFO: 0, COMMAND: 1, WARNING: 2, ERROR: 3 };
  byId("marks").replaceChildren(...[...marks].sort((a, b) => rank[a.kind] - rank[b.kind]).map((mark) => {
    const node = el("span", { class: `mark ${mark.kind}`, title: `${clock(mark.at_ms - start)} ${mark.text}` });
    node.style.left = `${(100 * (mark.at_ms - start)) / Math.max(1, end - start)}%`;
    node.onclick = () => seek(mark.at_ms);
    return node;
  }));
}

const toggle = () => send("play", { playing: !playback().playing });

function seek(at_ms) {
  clearTimeout(later);
  sentAt = performance.now();
  send("seek", { at_ms });
}

// While it is dragged, no more seeks than can be shown; the last one always goes out.
function seekSoon(at_ms) {
  clearTimeout(later);
  const wait = sentAt + SEEK_EVERY_MS - performance.now();
  if (wait <= 0) seek(at_ms);
  else later = setTimeout(seek, wait, at_ms);
}

function clock(ms) {
  const tenths = Math.floor(Math.max(0, ms) / 100), minutes = Math.floor(tenths / 600);
  return `${minutes}:${((tenths % 600) / 10).toFixed(1).padStart(4, "0")}`;
}

// A moment of a flight: the time of day, in a replay the time in the recording.
export function momentWords(atMs) {
  return replaying() ? clock(atMs - replay().start_ms) : new Date(Date.now() - (now() - atMs)).toTimeString().slice(0, 8);
}

function showTime(ms) {
  const words = `${clock(ms)} of ${clock(replay().end_ms - replay().start_ms)}`;
  text(byId("reel-time"), words);
  byId("reel").setAttribute("aria-valuetext", words);
}

export function showPlayback() {
  if (!store.scene?.replay) return;
  const { at_ms, playing, speed, ended } = playback(), gone = at_ms - replay().start_ms, button = byId("play");
  button.dataset.playing = playing;
  const words = playing ? "Pause" : ended ? "Play again from the start" : "Play";
  if (button.getAttribute("aria-label") !== words) button.setAttribute("aria-label", words);
  button.title = `${words} (space)`;
  const list = byId("speed");
  if (document.activeElement !== list) {
    if (![...list.options].some((option) => Number(option.value) === speed)) list.append(el("option", { value: speed }, `${speed} ×`));
    list.value = speed;
  }
  if (dragging) return;
  byId("reel").value = gone;
  showTime(gone);
}

function faster(by) {
  const at = SPEEDS.reduce((best, value, index) => (Math.abs(value - playback().speed) < Math.abs(SPEEDS[best] - playback().speed) ? index : best), 0);
  send("speed", { factor: SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, at + by))] });
}

function toMark(direction) {
  const at = playback().at_ms, times = replay().marks.map((mark) => mark.at_ms).sort((a, b) => a - b);
  const found = direction > 0 ? times.find((time) => time > at + 1) : times.findLast((time) => time < at - 300);
  if (found !== undefined) seek(found);
}

// Returns whether the key was one of ours. One that is held acts no more often than the server takes messages, with room
// for the page's answers.
export function playbackKey(event) {
  const action = actionOf(event), at = performance.now();
  if (action && !(event.repeat && at - actedAt < HELD_EVERY_MS)) {
    actedAt = at;
    action();
  }
  return Boolean(action);
}

// Where a control has its own use for a key, it keeps it.
function actionOf(event) {
  const within = (kinds) => event.target instanceof Element && event.target.closest(kinds);
  if (within("button, summary, a") && PRESS.has(event.key)) return null;
  if (within("input, select") && (PRESS.has(event.key) || MOVE.has(event.key))) return null;
  const { start_ms: start, end_ms: end } = replay();
  switch (event.key) {
    case " ": return () => { if (!event.repeat) toggle(); };
    case ",": return () => send("step", { ticks: -1 });
    case ".": return () => send("step", { ticks: 1 });
    case "ArrowLeft": return () => seekSoon(playback().at_ms - JUMP_MS);
    case "ArrowRight": return () => seekSoon(playback().at_ms + JUMP_MS);
    case "Home": return () => seek(start);
    case "End": return () => seek(end);
    case "<": return () => faster(-1);
    case ">": return () => faster(1);
    case "[": return () => toMark(-1);
    case "]": return () => toMark(1);
    default: return null;
  }
}
