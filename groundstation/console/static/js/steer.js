// The map's pointer and keys: pan and zoom always; dragging and driving targets in simulation only.
// Keys drive the one that was dragged last, the first at the start.

import { byId } from "./dom.js";
import { send } from "./link.js";
import { mayGive, mayOperate } from "./own_orders.js";
import { entity, steerable, store } from "./store.js";

const SPEED_M_S = 0.4, TURN_RAD_S = 1.2, PERIOD_MS = 100, GRAB_PX = 24, PLACE_MS = 100;
const KEYS = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, 1], ArrowRight: [0, -1] };
const down = new Set(), pointers = new Map();
let ghost = null, driving = 0, lastPlaced = 0, held = "";

export const ghostPoint = () => ghost;
export const maySteer = () => steerable() && mayGive("TAKEOFF") && mayOperate();

function grabbed(view, x, y) {
  return store.scene.targets.find(({ name }) => {
    const there = store.s.truth?.[name]?.position ?? entity(name)?.mean;
    if (!there) return false;
    const [px, py] = view.point(there[0], there[1]);
    return Math.hypot(px - x, py - y) < GRAB_PX;
  });
}

export function startSteering(canvas, view) {
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    const target = maySteer() && pointers.size === 1 ? grabbed(view, event.offsetX, event.offsetY) : null;
    if (target) [held, ghost] = [target.name, view.world(event.offsetX, event.offsetY)];
  });
  canvas.addEventListener("pointermove", (event) => move(event, view));
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => drop(event, view));
  canvas.addEventListener("keydown", (event) => key(event, view));
  canvas.addEventListener("keyup", (event) => { if (event.key in KEYS) { down.delete(event.key); drive(); } });
  canvas.addEventListener("blur", () => { if (down.size) { down.clear(); drive(); } });
  byId("zoom-in").onclick = () => view.zoom(1.3);
  byId("zoom-out").onclick = () => view.zoom(1 / 1.3);
  byId("zoom-fit").onclick = () => view.fit();
}

function move(event, view) {
  const before = pointers.get(event.pointerId);
  if (!before) return;
  const after = [event.offsetX, event.offsetY];
  if (ghost) {
    ghost = inside(view.world(...after));
    if (performance.now() - lastPlaced > PLACE_MS) place();
    view.changed();
  } else if (pointers.size === 2) {
    const [other] = [...pointers.entries()].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    const gap = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) || 1;
    view.zoom(gap(after) / gap(before), (after[0] + other[0]) / 2, (after[1] + other[1]) / 2);
  } else view.pan(after[0] - before[0], after[1] - before[1]);
  pointers.set(event.pointerId, after);
}

function drop(event, view) {
  pointers.delete(event.pointerId);
  if (!ghost) return;
  place();
  ghost = null;
  view.changed();
}

function inside([x, y]) {
  const [w, h] = store.scene.room.size_m, keep = (value, half) => Math.min(half - 0.2, Math.max(0.2 - half, value));
  return [keep(x, w / 2), keep(y, h / 2)];
}

function place() {
  lastPlaced = performance.now();
  const [x_m, y_m] = inside(ghost);
  send("place", { x_m, y_m, target: held });
}

function key(event, view) {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.key in KEYS && maySteer()) { event.preventDefault(); press(event.key); }
  else if (event.key === "+" || event.key === "=") view.zoom(1.2);
  else if (event.key === "-") view.zoom(1 / 1.2);
  else if (event.key === "0") view.fit();
}

// A held key repeats itself, on some keyboards more often than the server takes messages: the first press counts.
function press(name) {
  if (down.has(name)) return;
  down.add(name);
  drive();
}

// While a key is down the order is repeated: what stops being repeated is a page that died, and is seen as such.
function drive() {
  clearInterval(driving);
  const [forward, left] = [...down].reduce(([a, b], name) => [a + KEYS[name][0], b + KEYS[name][1]], [0, 0]);
  const order = () => maySteer() && send("drive", { speed_m_s: forward * SPEED_M_S, turn_rad_s: left * TURN_RAD_S, target: held });
  order();
  if (down.size) driving = setInterval(order, PERIOD_MS);
}
