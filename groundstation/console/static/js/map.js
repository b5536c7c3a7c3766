// The map: from the floor up, one function for each layer.

import { drawBodies, drawEllipses, drawGhost, drawStanding, drawTrails, drawTruth, drawVelocities } from "./map_bodies.js";
import { clearLabels, placeLabels } from "./labels.js";
import { drawRoom } from "./map_room.js";
import { drawSearchMaps } from "./map_search.js";
import { drawFootprints, drawGraph } from "./map_sensing.js";
import { estimateAge, store } from "./store.js";

const STALE_S = 0.5;
export const layers = { footprints: true, graph: true, trails: true, velocities: true, truth: true };
// marks: when the first picture of the room stood [ms since the page was asked for], how old what we showed was when a
// banner said so [s], and how long the browser had not let us draw until then [s].
export const drawn = { draws: 0, ms: 0, ellipses: {}, labels: [], latencies: [], gapS: 0, marks: {} };

export function drawMap(view, ghost) {
  if (!store.scene) return;
  const began = performance.now();
  const g = view.canvas.getContext("2d");
  g.setTransform(view.ratio, 0, 0, view.ratio, 0, 0);
  clearLabels();
  drawRoom(g, view);
  const stale = estimateAge() > STALE_S || !store.connected;
  g.globalAlpha = stale ? 0.4 : 1;
  drawSearchMaps(g, view);
  if (layers.footprints) drawFootprints(g, view);
  if (layers.trails) drawTrails(g, view);
  if (layers.graph) drawGraph(g, view);
  drawn.ellipses = drawEllipses(g, view);
  if (layers.truth && store.scene.truth) drawTruth(g, view);
  if (layers.velocities) drawVelocities(g, view, stale);
  drawStanding(g, view);
  drawBodies(g, view, stale);
  g.globalAlpha = 1;
  drawn.labels = placeLabels(g, view);
  if (ghost) drawGhost(g, view, ghost);
  drawn.draws += 1;
  drawn.marks.firstMs ??= performance.now();
  drawn.ms = performance.now() - began;
}
