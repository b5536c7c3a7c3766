// Where a target may be that is searched for: the darker a cell, the likelier.

import { colourOf } from "./palette.js";
import { store } from "./store.js";

const MOST = 0.55, LEAST = 8;

export function drawSearchMaps(g, view) {
  const alpha = g.globalAlpha;
  for (const [name, { first, cell, columns, chances }] of Object.entries(store.s.search_maps ?? {})) {
    g.fillStyle = colourOf(name);
    const side = cell * view.scale;
    chances.forEach((chance, index) => {
      if (chance < LEAST) return;
      const [x, y] = view.point(first[0] + (index % columns) * cell, first[1] + Math.floor(index / columns) * cell);
      g.globalAlpha = alpha * MOST * (chance / 255);
      g.fillRect(x - side / 2, y - side / 2, side, side);
    });
  }
  g.globalAlpha = alpha;
}
