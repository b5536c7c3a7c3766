// Live pictures with what was detected in exactly that picture; only cameras on screen are asked for.

import { byId, el, seconds, text } from "./dom.js";
import { on, watch } from "./link.js";
import { colourInPicture } from "./palette.js";
import { ageS, store } from "./store.js";

const LINE_PX = 22; // of words in a picture
const STALE_S = 1.5;
const feeds = new Map(), visible = new Set(), waiting = new Map();
let observer = null, decoder = null;

export const pictures = { frames: 0, marks: 0 };

export function buildCameras() {
  observer?.disconnect();
  visible.clear();
  feeds.clear();
  const { cameras, drones } = store.scene;
  const names = [...drones.filter((drone) => drone.camera).map((drone) => drone.camera.name), ...cameras.map((camera) => camera.name)];
  byId("cameras").replaceChildren(...names.map(feed));
  observer = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) isIntersecting ? visible.add(target.dataset.camera) : visible.delete(target.dataset.camera);
    choose();
  });
  for (const { root } of feeds.values()) observer.observe(root);
}

const choose = () => watch(document.hidden ? [] : [...visible].sort());

function feed(name) {
  const canvas = el("canvas", { width: 320, height: 180, role: "img", "aria-label": `Picture of ${name}` });
  const age = el("span", { class: "num" }), veil = el("span", { class: "pill veil", data: { level: "wait" } }, "no picture yet");
  const root = el("figure", { class: "camera", data: { camera: name, testid: `camera-${name}` } }, el("figcaption", {}, el("span", {}, name), age), el("div", { class: "picture" }, canvas, veil));
  feeds.set(name, { root, canvas, age, veil, bitmap: null, stamp: null, marked: null, newest: null, decoding: false });
  return root;
}

export function startCameras() {
  document.addEventListener("visibilitychange", choose);
  on("picture", (head, jpeg) => {
    const target = feeds.get(head.camera);
    if (!target) return;
    target.newest = [head, jpeg];
    if (!target.decoding) decode(head.camera, target);
  });
}

// One picture of a camera at a time, and then the newest: a slow device would otherwise fall behind for ever.
async function decode(name, target) {
  target.decoding = true;
  try {
    while (target.newest) {
      const [head, jpeg] = target.newest;
      target.newest = null;
      const bitmap = await decoded(name, jpeg);
      if (!bitmap) continue;
      target.bitmap?.close();
      Object.assign(target, { bitmap, stamp: head.stamp_ms, marked: null });
      pictures.frames += 1;
      draw(name, target);
    }
  } finally { // a picture that cannot be drawn must not be the camera's last
    target.decoding = false;
  }
}

// Beside the page: where a browser is busy, what decodes waits 15 ms for another of its processes.
function decoded(name, jpeg) {
  decoder ??= startDecoder();
  return new Promise((resolve) => {
    waiting.set(name, resolve);
    decoder.postMessage({ name, jpeg }, [jpeg.buffer]);
  });
}

function startDecoder() {
  const worker = new Worker(new URL("./picture_decoder.js", import.meta.url));
  worker.onmessage = ({ data: { name, bitmap } }) => waiting.get(name)(bitmap);
  return worker;
}

// Detections of a picture may come after it.
export function showDetections() {
  for (const [name, target] of feeds) if (target.bitmap && target.marked !== target.stamp && foundIn(name, target)) draw(name, target);
}

function foundIn(name, { stamp }) {
  const found = store.s.detections?.[name];
  return found && Math.abs(found.stamp_ms - stamp) <= 0.01 ? found : null;
}

function draw(name, target) {
  const { canvas, bitmap } = target, found = foundIn(name, target);
  const shown = Math.round((canvas.clientWidth || 320) * Math.min(2, devicePixelRatio || 1));
  const width = Math.max(120, Math.min(bitmap.width, shown)), height = Math.round((bitmap.height * width) / bitmap.width);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const g = canvas.getContext("2d");
  g.drawImage(bitmap, 0, 0, width, height);
  if (!found) return;
  target.marked = target.stamp;
  // Marks are in pixels of the calibration, which need not be those of the picture.
  const zoom = width / found.width, written = [], rings = found.marks.map((mark) => [mark.u * zoom, mark.v * zoom, Math.max(8, mark.r * zoom)]);
  for (const [index, mark] of found.marks.entries()) {
    const [u, v, r] = rings[index], tint = colourInPicture(mark.subject);
    for (const [style, line] of [["#000", 5], [tint, 2.5]]) {
      g.strokeStyle = style;
      g.lineWidth = line;
      g.beginPath();
      g.arc(u, v, r, 0, 7);
      g.stroke();
    }
    g.font = `700 ${14 * Math.min(2, devicePixelRatio || 1)}px system-ui, "DejaVu Sans", sans-serif`;
    g.lineWidth = 4;
    g.strokeStyle = "#000";
    const words = `${mark.subject} ${mark.range_m.toFixed(1)} m away`;
    const long = g.measureText(words).width, place = placeFor([u, v, r + 5], long, [width, height], written, rings);
    written.push([...place, long]);
    g.strokeText(words, ...place);
    g.fillStyle = tint;
    g.fillText(words, ...place);
    pictures.marks += 1;
  }
}

// Where words stand wholly within the picture, beside their ring: right of it, left, below or above, off other words and
// rings if possible.
export function placeFor([u, v, r], long, [width, height], written, rings) {
  const baseline = Math.min(Math.max(v + 5, LINE_PX), height - 6), middle = Math.min(Math.max(u - long / 2, 4), width - long - 4);
  const all = [[Math.max(u + r, 4), baseline], [Math.min(u - r, width - 4) - long, baseline], [middle, v + r + LINE_PX], [middle, v - r]];
  const within = all.filter(([x, y]) => x >= 4 && x + long <= width - 4 && y >= LINE_PX && y <= height - 6);
  const free = ([x, y]) => !written.some(([left, line, other]) => x < left + other && left < x + long && Math.abs(y - line) < LINE_PX)
    && !rings.some(([cx, cy, size]) => x < cx + size && cx - size < x + long && y - LINE_PX < cy + size && cy - size < y);
  return within.find(free) ?? within[0] ?? [middle, baseline];
}

export function showCameras() {
  for (const [name, { root, age, veil, stamp }] of feeds) {
    const status = store.s.cameras?.[name], old = ageS(stamp), stale = old > STALE_S || !store.connected;
    root.classList.toggle("stale", stale && stamp !== null);
    text(age, [status && `${status.fps.toFixed(0)} fps`, Number.isFinite(old) && `${old.toFixed(1)} s old`].filter(Boolean).join(", "));
    const refused = store.s.refused_pictures?.[name];
    veil.hidden = !stale && !refused;
    text(veil, refused ? refused : stamp === null ? (status && !status.connected ? `no pictures${status.detail ? `: ${status.detail}` : ""}` : "no picture yet") : `${seconds(old)} old`);
    veil.dataset.level = stamp === null && !refused ? "wait" : "bad";
  }
}
