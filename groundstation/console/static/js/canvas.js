// Drawing helpers of all layers of the map: lines in world coordinates, words with a halo, arrows.

import { ink } from "./palette.js";

export function path(g, view, points, close = false) {
  g.beginPath();
  points.forEach(([x, y], index) => { const p = view.point(x, y); index ? g.lineTo(...p) : g.moveTo(...p); });
  if (close) g.closePath();
}

export function label(g, textValue, x, y, colour, size = 14, weight = 600, align = "center") {
  g.font = `${weight} ${size}px system-ui, "DejaVu Sans", sans-serif`;
  g.textAlign = align;
  g.lineWidth = 3;
  g.lineJoin = "round";
  g.strokeStyle = ink().halo;
  g.strokeText(textValue, x, y);
  g.fillStyle = colour;
  g.fillText(textValue, x, y);
}

// An arrow that ends `gap` pixels before its goal.
export function drawArrow(g, [x0, y0], [x1, y1], width, colour, gap = 0, hollow = false) {
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
