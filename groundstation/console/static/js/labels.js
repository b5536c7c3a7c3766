// Words on the map that give way to each other: first the important ones, each at the first free of its places. A name
// without a free place stands where it covers the least.

import { label } from "./canvas.js";

const LINE = 1.2;
// Names can be read however faint the body is that they name: those who are lost are looked for first.
const READABLE = 0.85;
// NAME: always drawn, if need be over others; SENSOR, FIGURE: left out where there is no room.
export const NAME = 0, SENSOR = 1, FIGURE = 2;
let waiting = [], taken = [];
// The place that a label had in the last picture: it is tried first, so that words do not jump to and fro.
const held = new Map();

export function clearLabels() {
  waiting = [];
  taken = [];
}

// Keep words off a disc: who stands there must be seen.
export function keepClear(x, y, radius) {
  taken.push({ left: x - radius, right: x + radius, top: y - radius, bottom: y + radius });
}

// of: what it names, such as "drone_1"; places: [x, y, align] each, the best first.
export function note(g, rank, of, words, places, colour, size, weight) {
  waiting.push({ rank, key: `${rank} ${of}`, words, places, colour, size, weight, alpha: g.globalAlpha });
}

// Above, below and beside a body of a radius; then further off, by lines and aslant.
export function around(x, y, radius, size) {
  const up = y - radius, down = y + radius + size, side = y + size / 3, line = size * LINE;
  return [[x, up, "center"], [x, down, "center"], [x + radius, side, "left"], [x - radius, side, "right"],
    [x + radius, up, "left"], [x - radius, up, "right"], [x + radius, down, "left"], [x - radius, down, "right"],
    [x, up - line, "center"], [x, down + line, "center"], [x, up - 2 * line, "center"], [x, down + 2 * line, "center"]];
}

// Draws what was noted; returns where, in pixels.
export function placeLabels(g, { width, height }) {
  const placed = [], alpha = g.globalAlpha;
  for (const one of [...waiting].sort((a, b) => a.rank - b.rank)) {
    g.font = `${one.weight} ${one.size}px system-ui, "DejaVu Sans", sans-serif`;
    const wide = g.measureText(one.words).width, last = held.get(one.key) ?? 0;
    const order = [last, ...one.places.keys()].filter((index) => index < one.places.length);
    const boxes = order.map((index) => ({ index, ...boxOf(one, one.places[index], wide) }));
    const inside = (box) => box.left >= 0 && box.right <= width && box.top >= 0 && box.bottom <= height;
    const free = boxes.find((box) => inside(box) && !taken.some((other) => overlap(box, other)));
    if (!free && one.rank !== NAME) continue;
    const box = free ?? leastCovering(boxes, inside), [x, y, align] = one.places[box.index];
    held.set(one.key, box.index);
    taken.push(box);
    placed.push({ words: one.words, ...box });
    g.globalAlpha = one.rank === NAME ? Math.max(READABLE, one.alpha) : one.alpha;
    label(g, one.words, x, y, one.colour, one.size, one.weight, align);
  }
  g.globalAlpha = alpha;
  return placed;
}

function boxOf({ size }, [x, y, align], wide) {
  const left = align === "left" ? x : align === "right" ? x - wide : x - wide / 2;
  return { left, right: left + wide, top: y - size, bottom: y + 0.3 * size };
}

// The first of those that cover the least of what is taken, within the map if one is.
function leastCovering(boxes, inside) {
  const cost = (box) => taken.reduce((sum, other) => sum + shared(box, other), inside(box) ? 0 : Infinity);
  return boxes.reduce((best, box) => (cost(box) < cost(best) ? box : best));
}

function shared(a, b) {
  const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
  const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
  return Math.max(0, wide) * Math.max(0, high);
}

const overlap = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
