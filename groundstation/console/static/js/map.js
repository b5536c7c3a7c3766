// The map: from the floor up, one function for each layer.

import { bodyToWorld, ellipse95, footprint, thickness } from "./geometry.js";
import { colourOf, ink } from "./palette.js";
import { ageS, droneNames, entities, entity, estimateAge, isSeen, store } from "./store.js";

const ARROW_S = 1.5, STALE_S = 0.5, OLD_S = 2;
// Who has not been seen for long is greyed even while the tracker speaks.
const fade = (body) => (body.age_s > OLD_S ? 0.45 : 1);
export const layers = { footprints: true, graph: true, trails: true, velocities: true, truth: true };
export const drawn = { draws: 0, ms: 0, ellipses: {}, latencies: [] };

export function drawMap(view, ghost) {
  if (!store.scene) return;
  const began = performance.now();
  const g = view.canvas.getContext("2d");
  g.setTransform(view.ratio, 0, 0, view.ratio, 0, 0);
  drawRoom(g, view);
  const stale = estimateAge() > STALE_S || !store.connected;
  g.globalAlpha = stale ? 0.4 : 1;
  if (layers.footprints) drawFootprints(g, view);
  if (layers.trails) drawTrails(g, view);
  if (layers.graph) drawGraph(g, view);
  drawEllipses(g, view);
  if (layers.truth && store.scene.truth) drawTruth(g, view);
  if (layers.velocities) drawVelocities(g, view, stale);
  drawBodies(g, view, stale);
  g.globalAlpha = 1;
  if (ghost) drawGhost(g, view, ghost);
  drawn.draws += 1;
  drawn.ms = performance.now() - began;
}

function path(g, view, points, close = false) {
  g.beginPath();
  points.forEach(([x, y], index) => { const p = view.point(x, y); index ? g.lineTo(...p) : g.moveTo(...p); });
  if (close) g.closePath();
}

function label(g, textValue, x, y, colour, size = 12, weight = 600, align = "center") {
  g.font = `${weight} ${size}px system-ui, "DejaVu Sans", sans-serif`;
  g.textAlign = align;
  g.lineWidth = 3;
  g.lineJoin = "round";
  g.strokeStyle = ink().halo;
  g.strokeText(textValue, x, y);
  g.fillStyle = colour;
  g.fillText(textValue, x, y);
}

// --- what does not move --------------------------------------------------------------------------------------------

function drawRoom(g, view) {
  const colours = ink(), [w, h] = store.scene.room.size_m;
  g.fillStyle = colours.outside;
  g.fillRect(0, 0, view.width, view.height);
  const [left, top] = view.point(-w / 2, h / 2);
  g.fillStyle = colours.floor;
  g.fillRect(left, top, w * view.scale, h * view.scale);
  g.lineWidth = 1;
  g.strokeStyle = colours.grid;
  for (let x = Math.ceil(-w / 2); x <= w / 2; x++) { path(g, view, [[x, -h / 2], [x, h / 2]]); g.stroke(); }
  for (let y = Math.ceil(-h / 2); y <= h / 2; y++) { path(g, view, [[-w / 2, y], [w / 2, y]]); g.stroke(); }
  g.strokeStyle = colours.axis;
  g.lineWidth = 1.5;
  g.strokeRect(left, top, w * view.scale, h * view.scale);
  drawTicks(g, view, w, h, colours);
  drawFence(g, view, colours);
  drawPads(g, view, colours);
}

function drawTicks(g, view, w, h, colours) {
  for (let x = Math.ceil(-w / 2); x <= w / 2; x++) { const [px, py] = view.point(x, -h / 2); label(g, `${x}`, px, py + 15, colours.dim, 11, 400); }
  for (let y = Math.ceil(-h / 2); y <= h / 2; y++) { const [px, py] = view.point(-w / 2, y); label(g, `${y}`, px - 8, py + 4, colours.dim, 11, 400, "right"); }
  const [px, py] = view.point(w / 2, -h / 2);
  label(g, "x, y [m]", px, py + 30, colours.dim, 11, 400, "right");
}

function drawFence(g, view, colours) {
  const fence = store.scene.room.fence;
  if (!fence) return;
  const [x0, x1] = fence.x_m, [y0, y1] = fence.y_m;
  g.setLineDash([7, 5]);
  g.lineWidth = 1.5;
  g.strokeStyle = colours.fence;
  path(g, view, [[x0, y0], [x1, y0], [x1, y1], [x0, y1]], true);
  g.stroke();
  g.setLineDash([]);
}

function drawPads(g, view, colours) {
  for (const drone of store.scene.drones) {
    if (!drone.pad_m) continue;
    const [x, y] = view.point(...drone.pad_m), r = Math.max(5, 0.16 * view.scale);
    g.strokeStyle = colours.axis;
    g.lineWidth = 1;
    g.strokeRect(x - r, y - r, 2 * r, 2 * r);
    path(g, view, [drone.pad_m, [drone.pad_m[0] + 0.3 * Math.cos(drone.pad_yaw_rad), drone.pad_m[1] + 0.3 * Math.sin(drone.pad_yaw_rad)]]);
    g.stroke();
  }
}

// --- what cameras see ----------------------------------------------------------------------------------------------

function drawFootprints(g, view) {
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
    path(g, view, points, true);
    g.setLineDash([2, 4]);
    g.strokeStyle = ink().axis;
    g.lineWidth = 1.5;
    g.stroke();
    g.setLineDash([]);
    const top = points.reduce((best, p) => (p[1] > best[1] ? p : best));
    const [, y] = view.point(...top);
    label(g, `${camera.name} at ${height.toFixed(1)} m`, view.point(camera.position_m[0], 0)[0], y - 5, ink().dim, 11, 400);
  }
  for (const drone of store.scene.drones) {
    const body = entity(drone.name);
    if (!body || !drone.camera) continue;
    const [ox, oy] = bodyToWorld(drone.camera.position_m, body.mean[3]);
    const eye = [body.mean[0] + ox, body.mean[1] + oy, body.mean[2] + drone.camera.position_m[2]];
    const points = footprint(drone.camera.rays, eye, body.mean[3], store.scene.target.height_m);
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

function drawTrails(g, view) {
  const alpha = g.globalAlpha;
  for (const [name, trail] of Object.entries(store.trails)) {
    const isTarget = name === store.scene.target.name;
    g.strokeStyle = colourOf(name);
    g.lineWidth = isTarget ? 2 : 1.3;
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
  const target = entity(store.scene.target.name);
  if (!target) return;
  const { steps, step_s: step } = store.scene.horizon, [vx, vy] = target.velocity, [x, y] = target.mean;
  const points = [];
  for (let k = 0; k <= steps; k++) points.push([x + vx * step * k, y + vy * step * k]);
  g.strokeStyle = g.fillStyle = ink().target;
  g.setLineDash([3, 4]);
  g.lineWidth = 1.5;
  path(g, view, points);
  g.stroke();
  g.setLineDash([]);
  for (const point of points.slice(1)) { g.beginPath(); g.arc(...view.point(...point), 2, 0, 7); g.fill(); }
}

// --- sensing graph -------------------------------------------------------------------------------------------------

function place(name) {
  const body = entity(name);
  if (body) return body.mean;
  return store.scene.cameras.find((camera) => camera.name === name)?.position_m;
}

function drawGraph(g, view) {
  for (const camera of store.scene.cameras) drawCamera(g, view, camera);
  const plan = store.s.plan;
  if (!plan || ageS(plan.at) > 2) return;
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
    const [x, y] = view.point((a[0] + b[0]) / 2, (a[1] + b[1]) / 2);
    label(g, `${information >= 10 ? Math.round(information) : information.toFixed(1)} m⁻²${seen ? "" : " unseen"}`, x, y - 5, colour, 11, 500);
  }
}

function drawCamera(g, view, camera) {
  const [x, y] = view.point(camera.position_m[0], camera.position_m[1]);
  g.fillStyle = ink().link;
  g.fillRect(x - 7, y - 5, 14, 10);
  g.beginPath();
  g.arc(x, y, 3, 0, 7);
  g.fillStyle = ink().floor;
  g.fill();
  label(g, camera.name, x, y + 18, ink().dim, 11, 500);
}

// An arrow that ends `gap` pixels before its goal.
function drawArrow(g, [x0, y0], [x1, y1], width, colour, gap = 0, hollow = false) {
  const length = Math.hypot(x1 - x0, y1 - y0);
  if (length < gap + 4) return;
  const ux = (x1 - x0) / length, uy = (y1 - y0) / length, head = Math.min(length - gap, 6 + 1.6 * width);
  const ex = x1 - ux * gap, ey = y1 - uy * gap;
  g.strokeStyle = g.fillStyle = colour;
  g.lineWidth = width;
  g.beginPath();
  g.moveTo(x0, y0);
  g.lineTo(ex - ux * head * 0.9, ey - uy * head * 0.9);
  g.stroke();
  g.setLineDash([]);
  g.beginPath();
  g.moveTo(ex, ey);
  g.lineTo(ex - ux * head - uy * head * 0.5, ey - uy * head + ux * head * 0.5);
  g.lineTo(ex - ux * head + uy * head * 0.5, ey - uy * head - ux * head * 0.5);
  g.closePath();
  if (hollow) { g.lineWidth = 1.5; g.stroke(); } else g.fill();
}

// --- who is where --------------------------------------------------------------------------------------------------

function drawEllipses(g, view) {
  const alpha = g.globalAlpha;
  drawn.ellipses = {};
  for (const body of entities()) {
    const { name, mean, cov, converged } = body;
    const { major, minor, angle } = ellipse95(cov), [x, y] = view.point(mean[0], mean[1]);
    drawn.ellipses[name] = { x: mean[0], y: mean[1], major, minor };
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
}

function drawBodies(g, view, stale) {
  const alpha = g.globalAlpha;
  for (const body of entities()) {
    g.globalAlpha = alpha * fade(body);
    const [x, y] = view.point(body.mean[0], body.mean[1]);
    if (body.kind === "robot") drawDrone(g, x, y, body.mean[3], Math.max(13, 0.27 * view.scale), colourOf(body.name));
    else drawTarget(g, x, y, body.velocity, Math.max(9, 0.18 * view.scale), ink().target);
    const age = estimateAge() + body.age_s;
    const suffix = stale || age > 1 ? ` ${age.toFixed(1)} s old` : "";
    label(g, `${body.name}${suffix}`, x, y - Math.max(20, 0.36 * view.scale), body.kind === "robot" ? colourOf(body.name) : ink().text, 13, 700);
  }
  g.globalAlpha = alpha;
}

function drawDrone(g, x, y, yaw, r, colour) {
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
    g.fillStyle = ink().floor;
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

function drawVelocities(g, view, stale) {
  if (stale) return;
  const cuts = Object.fromEntries((store.s.plan?.controls ?? []).map((control) => [control.robot, control]));
  for (const [name, setpoint] of Object.entries(store.s.setpoints ?? {})) {
    const body = entity(name);
    if (!body || ageS(setpoint.at) > 0.5) continue;
    const from = view.point(body.mean[0], body.mean[1]), control = cuts[name];
    const tip = (v) => { const [dx, dy] = bodyToWorld(v, body.mean[3]); return view.point(body.mean[0] + dx * ARROW_S, body.mean[1] + dy * ARROW_S); };
    if (control?.wanted && control.limited_by.length) drawArrow(g, from, tip(control.wanted), 1.2, colourOf(name), 0, true);
    drawArrow(g, from, tip(setpoint.velocity), 3, ink().text);
    if (control?.limited_by.length) label(g, `cut by ${control.limited_by.join(", ")}`, from[0], from[1] + Math.max(26, 0.45 * view.scale), ink().fence, 11, 700);
  }
}

function drawTruth(g, view) {
  g.strokeStyle = ink().truth;
  g.lineWidth = 2;
  for (const [name, { position, yaw }] of Object.entries(store.s.truth ?? {})) {
    const [x, y] = view.point(position[0], position[1]), r = 6;
    g.beginPath();
    g.moveTo(x - r, y - r); g.lineTo(x + r, y + r);
    g.moveTo(x - r, y + r); g.lineTo(x + r, y - r);
    g.moveTo(x, y); g.lineTo(...view.point(position[0] + 0.32 * Math.cos(yaw), position[1] + 0.32 * Math.sin(yaw)));
    g.stroke();
    if (!entity(name)) label(g, `${name} (truth)`, x, y - 10, ink().truth, 11, 500);
  }
}

function drawGhost(g, view, [wx, wy]) {
  const [x, y] = view.point(wx, wy);
  g.strokeStyle = ink().truth;
  g.setLineDash([4, 3]);
  g.lineWidth = 2;
  g.beginPath();
  g.arc(x, y, Math.max(9, 0.18 * view.scale), 0, 7);
  g.stroke();
  g.setLineDash([]);
  label(g, `put here (${wx.toFixed(1)}, ${wy.toFixed(1)})`, x, y - 18, ink().truth, 12, 600);
}
