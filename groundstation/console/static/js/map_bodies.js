// Entities on the map: ellipses, drones, target, trails, velocities, the truth.

import { bodyToWorld, ellipse95 } from "./geometry.js";
import { colourOf, ink, isAgain } from "./palette.js";
import { drawArrow, label, path } from "./canvas.js";
import { seconds } from "./dom.js";
import { isDown, isLost } from "./glance.js";
import { NAME, around, keepClear, note } from "./labels.js";
import { withShortNames } from "./names.js";
import { ageS, entities, entity, estimateAge, isTarget, placed, store } from "./store.js";

const ARROW_S = 1.5, OLD_S = 2;
// Entities not seen for long are greyed even while the tracker publishes.
const fade = (body) => (body.age_s > OLD_S ? 0.45 : 1);

export function drawTrails(g, view) {
  const alpha = g.globalAlpha;
  for (const [name, trail] of Object.entries(store.trails)) {
    g.strokeStyle = colourOf(name);
    g.lineWidth = isTarget(name) ? 2 : 1.3;
    const third = Math.ceil(trail.length / 3);
    for (let part = 0; part < 3; part++) {
      const piece = trail.slice(Math.max(0, part * third - 1), (part + 1) * third);
      if (piece.length < 2) continue;
      g.globalAlpha = alpha * (0.15 + 0.2 * part);
      path(g, view, piece);
      g.stroke();
    }
  }
  g.globalAlpha = alpha;
  drawPrediction(g, view);
}

function drawPrediction(g, view) {
  for (const body of entities()) if (isTarget(body.name)) drawPredictionOf(g, view, body);
}

function drawPredictionOf(g, view, target) {
  const { steps, step_s: step } = store.scene.horizon, [vx, vy] = target.velocity, [x, y] = target.mean;
  const points = [];
  for (let k = 0; k <= steps; k++) points.push([x + vx * step * k, y + vy * step * k]);
  g.strokeStyle = g.fillStyle = colourOf(target.name);
  g.setLineDash([3, 4]);
  g.lineWidth = 1.5;
  path(g, view, points);
  g.stroke();
  g.setLineDash([]);
  for (const point of points.slice(1)) { g.beginPath(); g.arc(...view.point(...point), 2, 0, 7); g.fill(); }
}

// Returns what was drawn, in metres.
export function drawEllipses(g, view) {
  const alpha = g.globalAlpha, drawn = {};
  for (const body of entities()) {
    const { name, mean, cov, converged } = body;
    const { major, minor, angle } = ellipse95(cov), [x, y] = view.point(mean[0], mean[1]);
    drawn[name] = { x: mean[0], y: mean[1], major, minor };
    g.beginPath();
    g.ellipse(x, y, Math.min(5000, Math.max(2, major * view.scale)), Math.min(5000, Math.max(2, minor * view.scale)), -angle, 0, 2 * Math.PI);
    g.fillStyle = g.strokeStyle = colourOf(name);
    g.globalAlpha = alpha * 0.16;
    g.fill();
    g.globalAlpha = alpha * fade(body);
    g.lineWidth = 1.5;
    g.setLineDash(converged ? [] : [4, 3]);
    g.stroke();
    g.setLineDash([]);
  }
  g.globalAlpha = alpha;
  return drawn;
}

export function drawBodies(g, view, stale) {
  const alpha = g.globalAlpha;
  for (const body of entities()) {
    g.globalAlpha = alpha * fade(body);
    const [x, y] = view.point(body.mean[0], body.mean[1]);
    if (body.kind === "robot") drawDrone(g, x, y, body.mean[3], Math.max(13, 0.27 * view.scale), body.name);
    else drawTarget(g, x, y, body.velocity, Math.max(9, 0.18 * view.scale), colourOf(body.name));
    const age = estimateAge() + body.age_s;
    const suffix = stale ? `, ${seconds(age)} ago` : isLost(body.name) ? `, lost for ${seconds(age)}` : "";
    keepClear(x, y, bodyRadius(view) / 2);
    note(g, NAME, body.name, withShortNames(`${body.name}${suffix}`), around(x, y, bodyRadius(view), 14), colourOf(body.name), 14, 700);
  }
  g.globalAlpha = alpha;
}

// Where a fixed camera sees who stands: fainter than what flies, and without an ellipse, because no filter has it.
export function drawStanding(g, view) {
  const alpha = g.globalAlpha;
  for (const { name, place, yaw } of store.s.standing ?? []) {
    const [x, y] = view.point(...place);
    g.globalAlpha = alpha * 0.6;
    drawDrone(g, x, y, yaw ?? 0, Math.max(13, 0.27 * view.scale), name);
    g.globalAlpha = alpha;
    keepClear(x, y, bodyRadius(view) / 2);
    note(g, NAME, name, withShortNames(`${name} ${isDown(name) ? "is down" : "stands"}`), around(x, y, bodyRadius(view), 14), colourOf(name), 14, 500);
  }
}

// Within this distance of a body's middle no words stand [pixels].
const bodyRadius = (view) => Math.max(20, 0.36 * view.scale);

// Its rotors are filled where a drone before it has its colour.
function drawDrone(g, x, y, yaw, r, name) {
  const colour = colourOf(name);
  g.save();
  g.translate(x, y);
  g.rotate(-yaw);
  g.strokeStyle = g.fillStyle = colour;
  g.lineWidth = Math.max(2, r * 0.14);
  const arm = r * 0.62;
  for (const [a, b] of [[arm, arm], [arm, -arm]]) { g.beginPath(); g.moveTo(-a, -b); g.lineTo(a, b); g.stroke(); }
  for (const [a, b] of [[arm, arm], [arm, -arm], [-arm, arm], [-arm, -arm]]) {
    g.beginPath();
    g.arc(a, b, r * 0.4, 0, 7);
    g.fillStyle = isAgain(name) ? colour : ink().floor;
    g.fill();
    g.lineWidth = Math.max(1.5, r * 0.1);
    g.stroke();
  }
  g.fillStyle = colour;
  g.beginPath();
  g.moveTo(r * 1.25, 0);
  g.lineTo(r * 0.55, r * 0.38);
  g.lineTo(r * 0.55, -r * 0.38);
  g.closePath();
  g.fill();
  g.restore();
}

function drawTarget(g, x, y, [vx, vy], r, colour) {
  g.fillStyle = ink().floor;
  g.strokeStyle = colour;
  g.lineWidth = 3;
  g.beginPath();
  g.arc(x, y, r, 0, 7);
  g.fill();
  g.stroke();
  g.fillStyle = colour;
  g.save();
  g.translate(x, y);
  g.rotate(-Math.atan2(vy, vx));
  const s = r * 0.55;
  for (let i = 0; i < 4; i++) g.fillRect(-s + (i % 2) * s, -s + (i >> 1) * s, i === 0 || i === 3 ? s : 0, s);
  g.restore();
}

export function drawVelocities(g, view, stale) {
  if (stale) return;
  const cuts = Object.fromEntries((store.s.plan?.controls ?? []).map((control) => [control.robot, control]));
  for (const [name, setpoint] of Object.entries(store.s.setpoints ?? {})) {
    const body = entity(name);
    if (!body || ageS(setpoint.at) > 0.5) continue;
    const from = view.point(body.mean[0], body.mean[1]), control = cuts[name];
    const tip = (v) => { const [dx, dy] = bodyToWorld(v, body.mean[3]); return view.point(body.mean[0] + dx * ARROW_S, body.mean[1] + dy * ARROW_S); };
    if (control?.wanted && control.limited_by.length) drawArrow(g, from, tip(control.wanted), 1.2, colourOf(name), 0, true);
    drawArrow(g, from, tip(setpoint.velocity), 3, ink().text);
  }
}

export function drawTruth(g, view) {
  g.strokeStyle = ink().truth;
  g.lineWidth = 2;
  for (const [name, { position, yaw }] of Object.entries(store.s.truth ?? {})) {
    const [x, y] = view.point(position[0], position[1]), r = 6;
    g.beginPath();
    g.moveTo(x - r, y - r); g.lineTo(x + r, y + r);
    g.moveTo(x - r, y + r); g.lineTo(x + r, y - r);
    g.moveTo(x, y); g.lineTo(...view.point(position[0] + 0.32 * Math.cos(yaw), position[1] + 0.32 * Math.sin(yaw)));
    g.stroke();
    if (!placed(name) && !(store.s.standing ?? []).some((one) => one.name === name)) note(g, NAME, name, withShortNames(`${name} (true place)`), around(x, y, 10, 14), ink().truth, 14, 500);
  }
}

export function drawGhost(g, view, [wx, wy]) {
  const [x, y] = view.point(wx, wy);
  g.strokeStyle = ink().truth;
  g.setLineDash([4, 3]);
  g.lineWidth = 2;
  g.beginPath();
  g.arc(x, y, Math.max(9, 0.18 * view.scale), 0, 7);
  g.stroke();
  g.setLineDash([]);
  label(g, `put here (${wx.toFixed(1)}, ${wy.toFixed(1)})`, x, y - 18, ink().truth, 14, 600);
}
