// Puts the page together: what moves is drawn with the next picture of the screen, everything else at a slow beat.

import { startStrip } from "./alarm_strip.js";
import { addNotice, showBanners } from "./banners.js";
import { showBar, startBar } from "./bar.js";
import { buildCameras, pictures, showCameras, showDetections, startCameras } from "./cameras.js";
import { buildCharts, showSamples } from "./charts.js";
import { byId, el, svg } from "./dom.js";
import { keepEnd, showEnd } from "./ending.js";
import { guarded } from "./guard.js";
import { drawHeights } from "./heights.js";
import { connect, me, on, send } from "./link.js";
import { drawMap, drawn, layers } from "./map.js";
import { showControls, showOrders, startOrders } from "./commands.js";
import { takeNames } from "./names.js";
import { colourOf, fenceColour, ink, startTheme, takeColours } from "./palette.js";
import { give } from "./own_orders.js";
import { showPlan, showSwitch, showTimeline } from "./plan.js";
import { showEvents, showHealth, showProcesses, showTop } from "./status.js";
import { showPreflight } from "./preflight.js";
import { playbackKey, showPlayback, startPlayback } from "./playback.js";
import { listen, startSounds } from "./sounds.js";
import { ghostPoint, maySteer, startSteering } from "./steer.js";
import { atOneTime, entities, estimateAge, now, replaying, steerable, store, targetHeight } from "./store.js";
import { buildTeam, paint, showTeam, startTeam } from "./team.js";
import { View } from "./view.js";

const BEAT_MS = 200;
const NAMES = { footprints: "Footprints", graph: "Sensing graph", trails: "Trails", velocities: "Velocities", truth: "Truth" };
let asked = false, undrawnStamp = null, lastBeat = 0, builtFor = "";

const view = new View(byId("map"), redraw);

on("seed", () => {
  const { scene } = store, built = JSON.stringify(scene);
  // A replay that has jumped seeds the same scene again: what is in focus or being dragged must stay.
  if (built !== builtFor) build(scene);
  else guarded("charts", showSamples);
  builtFor = built;
  guarded("result", keepEnd);
  undrawnStamp = null;
  showAll();
  redraw();
});

function build(scene) {
  takeColours(scene);
  takeNames(scene);
  document.title = `${scene.replay ? `${scene.replay.what} ${scene.replay.name}` : scene.site} · Skein`;
  document.body.classList.toggle("replay", replaying());
  byId("site").textContent = scene.site;
  byId("sim").hidden = !scene.truth;
  for (const node of document.querySelectorAll(".only-sim")) node.hidden = !steerable();
  view.room = scene.room.size_m;
  if (view.fitted) view.fit();
  document.querySelector(".legend").open = (view.width - view.scale * view.room[0]) / 2 > 335;
  const made = { layers: buildLayers, legend: buildLegend, "new cards": buildTeam, "new cameras": buildCameras, "new charts": buildCharts, "new playback": startPlayback };
  for (const [part, make] of Object.entries(made)) guarded(part, make);
}

on("delta", (sections, sampled) => {
  if (sections.estimate) undrawnStamp = sections.estimate.at;
  if (sections.orders || sections.session) show("orders", "buttons");
  if (sections.playback) show("playback");
  if (sections.result) guarded("result", keepEnd);
  if (sections.detections) guarded("detections", showDetections);
  if (sampled) { guarded("charts", showSamples); guarded("timeline", showTimeline); }
  soundIfHidden();
  redraw();
});

// Timers of a page that has been hidden for long run once a minute; what it is sent comes at once.
function soundIfHidden() {
  if (document.hidden) show("sounds");
}

on("notice", (notice) => { addNotice(notice); show("alarms"); });
on("state", () => { show("alarms", "link", "buttons"); soundIfHidden(); redraw(); });

// First what an operator must not miss, and acts with.
const PARTS = {
  alarms: alarm, buttons: showControls, orders: showOrders, sounds: listen, bar: showBar, link: showTop, cards: showTeam, checks: showPreflight, cameras: showCameras, topology: showPlan, "topology's changes": showSwitch,
  estimator: showHealth, events: showEvents, processes: showProcesses, playback: showPlayback, end: showEnd, "words of the map": describe,
};
const show = (...parts) => parts.forEach((part) => guarded(part, PARTS[part]));
const showAll = () => show(...Object.keys(PARTS));

// The word as well must not be what it was.
function alarm() {
  try { showBanners(); } catch (error) {
    Object.assign(byId("safety"), { textContent: "ACT" });
    Object.assign(byId("safety-means"), { textContent: "this page fails:\nreload it" });
    byId("safety-box").dataset.level = "bad";
    throw error;
  }
}

function describe() {
  const note = byId("map-note");
  note.hidden = !store.scene || entities().length > 0 || store.s.standing?.length > 0;
  const words = entities().map(({ name, mean }) => `${name} at ${mean[0].toFixed(1)}, ${mean[1].toFixed(1)} m`).join("; ");
  byId("map").setAttribute("aria-label", `Map of the room. ${words || note.textContent}`);
}

// Only when there is something new: on a busy machine clicks wait behind every picture of the screen that is asked for.
function redraw() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(draw);
}

function draw() {
  asked = false; // first: what fails now does not stop what comes
  guarded("map", () => drawMap(view, ghostPoint()));
  if (undrawnStamp === null) return;
  drawn.latencies.push(now() - undrawnStamp);
  if (drawn.latencies.length > 200) drawn.latencies.shift();
  undrawnStamp = null;
}

// By a timer: ages grow while nothing comes, and a page that is hidden gets no picture of the screen to draw.
function beat() {
  const at = performance.now();
  drawn.gapS = (at - lastBeat) / 1000;
  lastBeat = at;
  atOneTime(showAll);
  guarded("heights", () => drawHeights(byId("heights"), view.ratio ?? 1));
  redraw();
}

function buildLayers() {
  byId("layers").replaceChildren(...Object.keys(layers).filter((name) => name !== "truth" || store.scene.truth).map((name) => {
    const button = el("button", { "aria-pressed": `${layers[name]}`, data: { testid: `layer-${name}` } }, NAMES[name]);
    button.onclick = () => { layers[name] = !layers[name]; button.setAttribute("aria-pressed", `${layers[name]}`); showSwitch(); redraw(); };
    return button;
  }));
}

function buildLegend() {
  const c = ink(), rows = [
    ["95 % ellipse of the position", svg("ellipse", { cx: 15, cy: 7, rx: 12, ry: 5, fill: c.dim, "fill-opacity": 0.25, stroke: c.dim })],
    ["link: expected precision; dashed: planned, nothing seen along it now", svg("path", { d: "M1 7 H16", stroke: c.link, "stroke-width": 5 }), svg("path", { d: "M18 7 H30", stroke: c.link, "stroke-width": 2, "stroke-dasharray": "4 3" })],
    [`camera footprint at ${targetHeight().toFixed(1)} m`, svg("path", { d: "M4 12 L26 12 L29 2 L1 2 Z", fill: c.dim, "fill-opacity": 0.2, stroke: c.dim })],
    ["velocity × 1.5 s", svg("path", { d: "M2 7 H22 M18 3 L25 7 L18 11", stroke: c.text, "stroke-width": 2.5, fill: "none" })],
    ["target's prediction", svg("path", { d: "M2 7 H28", stroke: colourOf(store.scene.targets[0]?.name), "stroke-width": 2, "stroke-dasharray": "2 4" })],
    ["fence", svg("path", { d: "M2 7 H28", stroke: fenceColour(), "stroke-width": 2, "stroke-dasharray": "7 4" })],
  ];
  if (Object.keys(store.scene.room.obstacles).length) rows.push(["obstacle", svg("rect", { x: 8, y: 2, width: 14, height: 10, fill: c.axis })]);
  if (store.scene.truth) rows.push(["truth (simulation)", svg("path", { d: "M10 2 L20 12 M20 2 L10 12", stroke: c.truth, "stroke-width": 2 })]);
  byId("legend").replaceChildren(...rows.map(([words, ...shapes]) => el("li", {}, svg("svg", { viewBox: "0 0 30 14" }, ...shapes), words)));
}

const toggleTheme = startTheme(() => {
  if (!store.scene) return;
  paint(); buildLegend(); buildCharts(); showPlan();
  redraw();
});
const toggleWall = startBar(() => view.resize()), toggleSound = startSounds(), toggleLog = startStrip();
byId("theme").onclick = toggleTheme;
// Not modal: what stops the team stays in reach.
const toggleHelp = () => byId("about").open ? byId("about").close() : byId("about").show();
byId("help").onclick = toggleHelp;

// A keyboard of another script has the letter where its key is.
const letterOf = ({ key, code }) => (/^[^\x00-\x7f]$/.test(key) ? code.replace("Key", "") : key).toLowerCase();

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  // Enter that is held down would press a button thirty times a second.
  if (event.repeat && event.key === "Enter" && event.target.closest?.("button")) event.preventDefault();
  if (event.repeat && !replaying()) return;
  const key = letterOf(event);
  if (replaying() && playbackKey(event)) event.preventDefault();
  else if (key === "l") give("LAND");
  else if (key === "h") give("HOLD");
  else if (key === "t") toggleTheme();
  else if (key === "w") toggleWall();
  else if (key === "m") toggleSound();
  else if (key === "a") toggleLog();
  else if (key === "p" && maySteer()) for (const { name } of store.scene.targets) send("followpath", { target: name });
  else if (key === "?") toggleHelp();
  else if (key === "escape") byId("about").close();
});

// State that tests read; changing it has no effect.
window.__console = {
  get state() {
    return {
      frames: store.frames, seeds: store.seeds, seq: store.seq, run: store.run, connected: store.connected, client: me.client, trusted: me.trusted,
      draws: drawn.draws, drawMs: drawn.ms, ellipses: structuredClone(drawn.ellipses), labels: structuredClone(drawn.labels), latencies: [...drawn.latencies], marks: structuredClone(drawn.marks), pictures: { ...pictures },
      playback: structuredClone(store.s.playback ?? null), nowMs: now(), sections: structuredClone(store.s), scene: structuredClone(store.scene), samples: store.samples.length,
      orders: structuredClone(store.s.orders ?? []), estimateAge: estimateAge(), trail: Object.fromEntries(Object.entries(store.trails).map(([name, trail]) => [name, trail.length])),
      scale: view.scale, points: Object.fromEntries(entities().map(({ name, mean }) => [name, view.point(mean[0], mean[1])])), at: Object.fromEntries(entities().map(({ name, mean }) => [name, mean])),
    };
  },
};

startOrders();
startTeam();
startCameras();
startSteering(byId("map"), view);
connect();
setInterval(beat, BEAT_MS);
