// The cameras' sensing: footprints, and the sensing graph with the information that each link brings.

import { bodyToWorld, footprint, thickness } from "./geometry.js";
import { colourOf, ink } from "./palette.js";
import { drawArrow, path } from "./canvas.js";
import { FIGURE, SENSOR, around, keepClear, note } from "./labels.js";
import { ageS, droneNames, entities, entity, isSeen, placed, store, targetHeight } from "./store.js";

const FIGURE_PX = 75;
export const DRAWN_S = 2; // a plan that is older is not drawn

export function drawFootprints(g, view) {
  const alpha = g.globalAlpha, [w, h] = store.scene.room.size_m;
  g.save();
  g.beginPath();
  g.rect(...view.point(-w / 2, h / 2), w * view.scale, h * view.scale);
  g.clip();
  for (const camera of store.scene.cameras) {
    const up = entities().filter((e) => e.kind === "robot").map((e) => e.mean[2]);
    const height = up.length ? Math.max(...up) : 0;
    const points = footprint(camera.rays, camera.position_m, 0, height);
    if (!points.length) continue;
    drawWorldView(g, view, points, `view of ${camera.name} at ${height.toFixed(1)} m`);
  }
  for (const volume of store.scene.volumes) drawVolume(g, view, volume);
  for (const drone of store.scene.drones) {
    const body = entity(drone.name);
    if (!body || !drone.camera) continue;
    const [ox, oy] = bodyToWorld(drone.camera.position_m, body.mean[3]);
    const eye = [body.mean[0] + ox, body.mean[1] + oy, body.mean[2] + drone.camera.position_m[2]];
    const points = footprint(drone.camera.rays, eye, body.mean[3], targetHeight());
    if (!points.length) continue;
    path(g, view, points, true);
    g.fillStyle = g.strokeStyle = colourOf(drone.name);
    g.globalAlpha = alpha * 0.09;
    g.fill();
    g.globalAlpha = alpha * 0.55;
    g.lineWidth = 1;
    g.stroke();
    g.globalAlpha = alpha;
  }
  g.restore();
}

function drawWorldView(g, view, points, words) {
  path(g, view, points, true);
  g.setLineDash([2, 4]);
  g.strokeStyle = ink().axis;
  g.lineWidth = 1.5;
  g.stroke();
  g.setLineDash([]);
  const x = points.map((p) => p[0]), y = points.map((p) => p[1]);
  const [left, low] = view.point(Math.min(...x), Math.min(...y)), [right, high] = view.point(Math.max(...x), Math.max(...y));
  note(g, FIGURE, words, words, [[left, low + 13, "left"], [right, low + 13, "right"], [left, high - 5, "left"], [right, high - 5, "right"]], ink().dim, 14, 400);
}

// The box in which a motion capture system sees bodies, at whatever height.
function drawVolume(g, view, { name, truth, x_m: [x0, x1], y_m: [y0, y1], z_m: [, top] }) {
  drawWorldView(g, view, [[x0, y0], [x1, y0], [x1, y1], [x0, y1]], `${name}${truth ? " (truth)" : ""} up to ${top.toFixed(1)} m`);
}

const middle = ([low, high]) => (low + high) / 2;

// Where the fixed sensors stand: cameras, and motion capture in the middle of its volume.
function worldSensors() {
  const volumes = store.scene.volumes.filter((volume) => !volume.truth);
  return [...store.scene.cameras, ...volumes.map(({ name, x_m, y_m, z_m }) => ({ name, position_m: [middle(x_m), middle(y_m), z_m[1]] }))];
}

function place(name) {
  const body = placed(name);
  if (body) return body.mean;
  return worldSensors().find((sensor) => sensor.name === name)?.position_m;
}

export function drawGraph(g, view) {
  for (const sensor of worldSensors()) drawSensor(g, view, sensor);
  const plan = store.s.plan;
  if (!plan || ageS(plan.at) > DRAWN_S) return;
  const alpha = g.globalAlpha;
  for (const [observer, subject, information] of plan.edges) {
    const a = place(observer), b = place(subject);
    if (!a || !b) continue;
    const seen = isSeen(observer, subject), colour = droneNames().includes(observer) ? colourOf(observer) : ink().link;
    g.globalAlpha = alpha * (seen ? 0.75 : 0.6);
    g.setLineDash(seen ? [] : [6, 6]);
    drawArrow(g, view.point(a[0], a[1]), view.point(b[0], b[1]), thickness(information), colour, 0.3 * view.scale);
    g.setLineDash([]);
    g.globalAlpha = alpha;
    // Where the link is shorter than its figure the thickness must do.
    if (Math.hypot(a[0] - b[0], a[1] - b[1]) * view.scale < FIGURE_PX) continue;
    const figure = information > 0 ? `± ${precision(information)}` : "";
    const places = [0.5, 0.4, 0.6, 0.3, 0.7].map((share) => onLink(view, a, b, share));
    note(g, FIGURE, `${observer} ${subject}`, `${figure}${seen ? "" : " planned"}`, places, colour, 14, 500);
  }
}

// The precision of one measurement: the standard deviation that its information [1/m²] amounts to.
function precision(information) {
  const metres = 1 / Math.sqrt(information);
  return metres < 1 ? `${(100 * metres).toFixed(0)} cm` : `${metres.toFixed(1)} m`;
}

function onLink(view, [ax, ay], [bx, by], share) {
  const [x, y] = view.point(ax + share * (bx - ax), ay + share * (by - ay));
  return [x, y - 5, "center"];
}

function drawSensor(g, view, sensor) {
  const [x, y] = view.point(sensor.position_m[0], sensor.position_m[1]);
  g.fillStyle = ink().link;
  g.fillRect(x - 7, y - 5, 14, 10);
  g.beginPath();
  g.arc(x, y, 3, 0, 7);
  g.fillStyle = ink().floor;
  g.fill();
  keepClear(x, y, 7);
  note(g, SENSOR, sensor.name, sensor.name, around(x, y, 8, 14).slice(1), ink().dim, 14, 500);
}
