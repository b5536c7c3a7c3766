// Curves over the last two minutes, drawn by uPlot.

import { byId, el, text } from "./dom.js";
import { colourOf, ink } from "./palette.js";
import { store } from "./store.js";

/* global uPlot */
const ofTarget = () => colourOf(store.scene.targets[0]?.name);
const HEIGHT = 118;
const CHARTS = [
  { title: "Target", unit: "m", curves: [["axis_m", "95 % semi-axis", ofTarget], ["error_m", "true error", () => ink().truth]], digits: 2 },
  { title: "Cost", unit: "cm²", curves: [["cost_cm2", "chosen topology", () => ink().text]], digits: 0 },
  { title: "NIS per degree of freedom", unit: "", curves: [["nis", "1 is ideal", () => ink().band]], digits: 2, band: true },
];
let made = [];

export function buildCharts() {
  made.forEach(({ plot }) => plot.destroy());
  const host = byId("charts");
  host.replaceChildren();
  made = CHARTS.map((chart) => build(chart, host));
  showSamples();
}

function build(chart, host) {
  const values = chart.curves.map(([, name, colour]) => {
    const swatch = el("i"), value = el("b", { class: "num" });
    swatch.style.background = colour();
    return { value, node: el("span", {}, swatch, `${name} `, value) };
  });
  const root = el("div", { class: "chart" }, el("div", { class: "title" }, el("b", {}, chart.title), ...values.map(({ node }) => node)));
  host.append(root);
  const axis = { stroke: ink().dim, grid: { stroke: ink().grid, width: 1 }, ticks: { show: false }, font: "14px system-ui, sans-serif" };
  const plot = new uPlot({
    width: Math.max(200, root.clientWidth), height: HEIGHT, legend: { show: false }, cursor: { points: { show: false } }, padding: [6, 18, 0, 0],
    scales: { x: { time: false, range: (_plot, low) => [Math.min(low ?? 0, -30), 0] }, y: { range: (_plot, _low, high) => [0, Math.max(high * 1.15, chart.band ? 2 : 1e-3)] } },
    axes: [{ ...axis, size: 24, values: (_plot, ticks) => ticks.map((tick) => (tick === 0 ? "now" : `${tick} s`)) }, { ...axis, size: 52 }],
    series: [{}, ...chart.curves.map(([, name, colour]) => ({ label: name, stroke: colour(), width: 2, points: { show: false } }))],
    hooks: chart.band ? { drawClear: [drawBand] } : {},
  }, [[], ...chart.curves.map(() => [])], root);
  new ResizeObserver(() => plot.setSize({ width: Math.max(200, root.clientWidth), height: HEIGHT })).observe(root);
  return { chart, plot, values };
}

function drawBand(plot) {
  const health = store.s.health;
  if (!health?.low) return;
  const top = plot.valToPos(health.high, "y", true), bottom = plot.valToPos(health.low, "y", true);
  plot.ctx.save();
  plot.ctx.fillStyle = ink().band;
  plot.ctx.globalAlpha = 0.18;
  plot.ctx.fillRect(plot.bbox.left, top, plot.bbox.width, Math.max(2, bottom - top));
  plot.ctx.restore();
}

export function showSamples() {
  const samples = store.samples, last = samples.at(-1);
  if (!last) return;
  const times = samples.map((sample) => (sample.t_ms - last.t_ms) / 1000);
  for (const { chart, plot, values } of made) {
    plot.setData([times, ...chart.curves.map(([key]) => samples.map((sample) => sample[key] ?? null))]);
    chart.curves.forEach(([key], index) => {
      const value = last[key];
      text(values[index].value, value === null || value === undefined ? "–" : `${value.toFixed(chart.digits)} ${chart.unit}`);
    });
  }
}
