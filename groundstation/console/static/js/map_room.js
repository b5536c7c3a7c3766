// The parts of the map that do not move: floor, grid, obstacles, fence, pads.

import { fenceColour, ink } from "./palette.js";
import { label, path } from "./canvas.js";
import { store } from "./store.js";

export function drawRoom(g, view) {
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
  drawObstacles(g, view, colours);
  drawTicks(g, view, w, h, colours);
  drawFence(g, view);
  drawPads(g, view, colours);
}

function drawTicks(g, view, w, h, colours) {
  for (let x = Math.ceil(-w / 2); x <= w / 2; x++) { const [px, py] = view.point(x, -h / 2); label(g, `${x}`, px, py + 15, colours.dim, 14, 400); }
  for (let y = Math.ceil(-h / 2); y <= h / 2; y++) { const [px, py] = view.point(-w / 2, y); label(g, `${y}`, px - 8, py + 4, colours.dim, 14, 400, "right"); }
  const [px, py] = view.point(w / 2, -h / 2);
  label(g, "x, y [m]", px, py + 30, colours.dim, 14, 400, "right");
}

function drawObstacles(g, view, colours) {
  g.fillStyle = colours.axis;
  for (const { centre_m: [x, y], size_m: [length, width] } of Object.values(store.scene.room.obstacles)) {
    const [left, top] = view.point(x - length / 2, y + width / 2);
    g.fillRect(left, top, length * view.scale, width * view.scale);
  }
}

function drawFence(g, view) {
  const fence = store.scene.room.fence;
  if (!fence) return;
  const [x0, x1] = fence.x_m, [y0, y1] = fence.y_m;
  g.setLineDash([7, 5]);
  g.lineWidth = 1.5;
  g.strokeStyle = fenceColour();
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
