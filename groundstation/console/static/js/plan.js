// The chosen sensing topology beside its alternatives, as small graphs with their costs.

import { byId, el, seconds, svg, text } from "./dom.js";
import { limitsOf } from "./duty.js";
import { lostTarget } from "./glance.js";
import { colourOf, ink } from "./palette.js";
import { layers } from "./map.js";
import { DRAWN_S } from "./map_sensing.js";
import { ageS, store } from "./store.js";

let shown = "";

export function showPlan() {
  const plan = store.s.plan, age = ageS(plan?.at), node = byId("plan");
  text(byId("plan-age"), plan ? (age > 1 ? `${seconds(age)} old` : "") : "");
  node.classList.toggle("stale-panel", age > 1 || !store.connected);
  const state = JSON.stringify([plan, document.documentElement.dataset.theme]);
  if (state === shown) return;
  shown = state;
  if (!plan) return node.replaceChildren(el("p", { class: "dim" }, "No plan yet: it needs a drone in the air that a camera sees."));
  const others = plan.alternatives.filter((option) => option.topology !== plan.topology);
  const worst = Math.max(plan.cost_cm2, ...others.map((option) => option.cost_cm2), 1e-9);
  const { solver } = plan;
  node.replaceChildren(
    el("div", { class: "chosen" }, glyph(plan),
      el("p", {}, el("span", { class: "cost num", data: { testid: "cost" } }, plan.cost), el("br"), el("strong", { data: { testid: "topology" } }, plan.words), el("br"),
        el("span", { class: "dim num" }, `${solver.ms.toFixed(0)} ms, ${solver.evaluations} evaluations, ${solver.topologies} topologies, ${solver.status.toLowerCase()}`))),
    el("div", { class: "options" }, option(plan, worst, plan, true), ...others.map((other) => option(other, worst, plan, false))),
    cuts(plan), el("div", { class: "timeline", id: "timeline" }));
  showTimeline();
}

// Below the sensing graph, for as long as that is drawn and the target is known: since when it is as it is, and why.
export function showSwitch() {
  const change = store.s.switch, node = byId("switch");
  node.hidden = !change || !layers.graph || lostTarget() || ageS(store.s.plan?.at) > DRAWN_S;
  if (change) text(node, `Who watches whom changed ${seconds(ageS(change.at))} ago: ${change.reason}`);
}

function option(item, worst, plan, now) {
  const bar = el("i");
  bar.style.width = `${Math.max(2, (100 * item.cost_cm2) / worst)}%`;
  const more = now ? "chosen" : `${item.bound_only ? "at least " : ""}${item.cost} (${item.cost_cm2 >= plan.cost_cm2 ? "+" : "−"}${Math.abs((100 * item.cost_cm2) / plan.cost_cm2 - 100).toFixed(0)} %)`;
  return el("div", { class: `option${now ? " now" : ""}${item.bound_only ? " bound" : ""}` }, glyph(item),
    el("div", {}, el("div", { class: "name num" }, el("span", {}, item.words), el("span", {}, more)), el("div", { class: "bar" }, bar)));
}

// Root: the fixed cameras; then the levels; leaf: the target.
function glyph({ topology, words }) {
  const levels = topology ? topology.split("/").map((level) => level.split(",")) : [];
  const width = 96, height = 78, rows = levels.length + 1, y = (row) => 9 + (row * (height - 18)) / rows;
  const x = (index, count) => (width * (index + 1)) / (count + 1);
  const nodes = [[[width / 2, y(0), null]], ...levels.map((level, row) => level.map((name, index) => [x(index, level.length), y(row + 1), name])), [[width / 2, y(rows), null]]];
  const root = svg("svg", { viewBox: `0 0 ${width} ${height}`, class: "glyph", role: "img", "aria-label": words });
  for (let row = 1; row < nodes.length; row++) for (const [ax, ay] of nodes[row - 1]) for (const [bx, by] of nodes[row]) {
    root.append(svg("line", { x1: ax, y1: ay, x2: bx, y2: by, stroke: ink().dim, "stroke-width": 2 }));
  }
  // A drone also sees the target itself if it is on the last level only: the edges above are the permitted ones.
  root.append(svg("rect", { x: width / 2 - 8, y: y(0) - 5, width: 16, height: 10, rx: 2, fill: ink().link }));
  for (const level of nodes.slice(1, -1)) for (const [cx, cy, name] of level) root.append(svg("circle", { cx, cy, r: 8, fill: colourOf(name) }));
  root.append(svg("circle", { cx: width / 2, cy: y(rows), r: 6, fill: ink().floor, stroke: ink().text, "stroke-width": 3 }));
  return root;
}

// Which topology was chosen when, by letters and shades: names are too long for short stays, so they stand below.
export function showTimeline() {
  const host = byId("timeline"), samples = store.samples.filter((sample) => sample.topology);
  if (!host || !samples.length) return;
  const runs = [];
  for (const { topology, t_ms } of samples) {
    if (runs.at(-1)?.topology === topology) runs.at(-1).to = t_ms;
    else runs.push({ topology, from: t_ms, to: t_ms });
  }
  const kinds = [...new Set(runs.map((run) => run.topology))].sort();
  const letter = (topology) => el("b", {}, String.fromCharCode(65 + kinds.indexOf(topology)));
  const shade = (topology) => `color-mix(in srgb, #0072b2 ${15 + (50 * kinds.indexOf(topology)) / kinds.length}%, transparent)`;
  const strip = el("div", { class: "strip" }, ...runs.map((run) => {
    const piece = el("span", { title: `${run.topology}, ${((run.to - run.from) / 1000).toFixed(0)} s` }, letter(run.topology));
    piece.style.flex = `${run.to - run.from + 500} 0 0`;
    piece.style.background = shade(run.topology);
    return piece;
  }));
  const keys = kinds.map((topology) => {
    const key = letter(topology);
    key.style.background = shade(topology);
    return el("span", {}, key, topology);
  });
  const span = (samples.at(-1).t_ms - samples[0].t_ms) / 1000, switches = runs.length - 1;
  host.replaceChildren(el("div", { class: "title num" }, el("span", {}, `last ${span.toFixed(0)} s`), el("span", {}, `${switches} switch${switches === 1 ? "" : "es"}`)), strip, el("div", { class: "keys" }, ...keys));
}

function cuts(plan) {
  const limited = plan.controls.filter(limitsOf);
  const lines = limited.map((control) => {
    const speed = (v) => Math.hypot(v[0], v[1]).toFixed(2);
    const how = control.wanted ? `${speed(control.wanted)} → ${speed(control.velocity)} m/s` : `now ${speed(control.velocity)} m/s`;
    return el("div", {}, el("strong", {}, control.robot), ` slowed by ${limitsOf(control)}: ${how}`);
  });
  return el("div", { class: "cuts num", data: { testid: "cuts" } }, ...(lines.length ? lines : [el("span", { class: "dim" }, "Safety limits nobody now.")]));
}
