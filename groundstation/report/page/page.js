// Draws the charts of a report: one cursor over all of them, drag to zoom, double click for the whole run.
"use strict";
/* global uPlot */
(() => {
  const charts = JSON.parse(document.getElementById("charts").textContent);
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const shade = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
  const HEIGHT = 170;
  const plots = [];

  function options(chart, width) {
    const axis = { stroke: css("--dim"), grid: { stroke: css("--grid"), width: 1 }, ticks: { show: false } };
    const shown = (value) => (value === null || value === undefined ? "–" : `${+value.toPrecision(4)}${chart.unit ? " " + chart.unit : ""}`);
    return {
      width, height: HEIGHT, cursor: { sync: { key: "run" }, focus: { prox: 24 } },
      scales: { x: { time: false }, y: chart.log ? { distr: 3 } : {} },
      axes: [{ ...axis, size: 24, values: (_plot, ticks) => ticks.map((tick) => (chart.axis ? `${tick} ${chart.axis}` : Number.isInteger(tick) ? `${tick}` : "")) }, { ...axis, size: 56 }],
      series: [
        { label: chart.axis ? "time" : "run", value: (_plot, value) => (value === null ? "–" : chart.axis ? `${value.toFixed(1)} ${chart.axis}` : `${value}`) },
        ...chart.curves.map((curve) => ({ label: curve.label || "upper", stroke: curve.color[shade], width: curve.dashed ? 1.2 : 1.8, dash: curve.dashed ? [5, 4] : undefined, points: { show: !chart.axis }, value: (_plot, value) => shown(value), spanGaps: false })),
      ],
      hooks: { drawClear: [(plot) => drawSpans(plot, chart.spans)], setScale: [follow] },
    };
  }

  function drawSpans(plot, spans) {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const span of spans) {
      const left = plot.valToPos(span.begin_s, "x", true), right = plot.valToPos(span.end_s, "x", true);
      ctx.globalAlpha = 0.16;
      ctx.fillStyle = span.color;
      ctx.fillRect(left, bbox.top, right - left, bbox.height);
      ctx.globalAlpha = 1;
      ctx.fillStyle = css("--dim");
      ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
      if (right - left > ctx.measureText(span.label).width + 8) ctx.fillText(span.label, left + 4, bbox.top + 13 * devicePixelRatio);
    }
    ctx.restore();
  }

  let following = false;
  function follow(plot, scale) {
    if (scale !== "x" || following) return;
    following = true;
    const { min, max } = plot.scales.x;
    for (const other of plots) if (other !== plot) other.setScale("x", { min, max });
    following = false;
  }

  for (const holder of document.querySelectorAll("[data-chart]")) {
    const chart = charts[Number(holder.dataset.chart)];
    const plot = new uPlot(options(chart, holder.clientWidth), [chart.time_s, ...chart.curves.map((curve) => curve.values)], holder);
    plots.push(plot);
    new ResizeObserver(() => plot.setSize({ width: holder.clientWidth, height: HEIGHT })).observe(holder);
  }
  window.__report = { charts: plots.length };
})();
