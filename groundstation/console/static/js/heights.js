// Heights of all drones: the room from the side, beside the map.

import { label } from "./canvas.js";
import { colourOf, ink, isAgain } from "./palette.js";
import { entities, estimateAge, isTarget, store } from "./store.js";

const MARGIN = 14, GAP = 16, STALE_S = 0.5;

export function drawHeights(canvas, ratio) {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !store.scene) return;
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const g = canvas.getContext("2d"), top = store.scene.room.size_m[2];
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, width, height);
  const y = (z) => height - MARGIN - (z / top) * (height - 2 * MARGIN);
  drawScale(g, y, top);
  const flying = entities().filter(({ name, mean }) => !isTarget(name) && mean.length > 2).sort((a, b) => b.mean[2] - a.mean[2]);
  let last = -Infinity;
  g.globalAlpha = estimateAge() > STALE_S || !store.connected ? 0.4 : 1; // as on the map
  for (const { name, mean } of flying) {
    const at = y(Math.min(top, Math.max(0, mean[2]))), words = Math.max(at, last + GAP);
    last = words;
    g.strokeStyle = colourOf(name);
    g.lineWidth = 3;
    g.setLineDash(isAgain(name) ? [3, 3] : []);
    g.beginPath(); g.moveTo(22, at); g.lineTo(36, at); g.stroke();
    g.setLineDash([]);
    label(g, `${mean[2].toFixed(2)} m`, 39, words + 4, colourOf(name), 14, 600, "left");
  }
  g.globalAlpha = 1;
  canvas.setAttribute("aria-label", `Heights. ${flying.map(({ name, mean }) => `${name} ${mean[2].toFixed(1)} m`).join("; ")}`);
}

function drawScale(g, y, top) {
  g.strokeStyle = ink().axis;
  g.lineWidth = 1;
  g.beginPath(); g.moveTo(22, y(0)); g.lineTo(22, y(top)); g.stroke();
  for (let z = 0; z <= top; z++) label(g, `${z}`, 18, y(z) + 4, ink().dim, 14, 500, "right");
  label(g, "z [m]", 22, y(top) - 4, ink().dim, 14, 500, "left");
}
