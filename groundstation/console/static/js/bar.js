// The bar on top: the team at a glance, how far the run is, and what it would accept.

import { worstBattery } from "./batteries.js";
import { byId, el, seconds, text } from "./dom.js";
import { oldestS, recording, STAGES, stage, stageWord, teamMode } from "./glance.js";
import { withShortNames } from "./names.js";
import { ageS, replaying, store } from "./store.js";
import { verdict } from "./verdict.js";

const WALL_KEY = "skein-wall", OLD_S = 1, TOO_OLD_S = 4;

function show(id, words, level) {
  const node = byId(id);
  text(node, words);
  if (level) node.dataset.level = level;
  else delete node.dataset.level;
}

export function showBar() {
  const [mode, level, who] = teamMode();
  show("team-mode", mode, level);
  text(byId("team-who"), withShortNames(who || "team"));
  const { airborne_since_ms: since, or_longer: longer } = store.s.flight ?? {}, airborne = since ? ageS(since) : null;
  show("air-time", airborne === null || replaying() ? "–" : `${longer ? "≥ " : ""}${Math.floor(airborne / 60)}:${String(Math.floor(airborne % 60)).padStart(2, "0")}`);
  const battery = worstBattery();
  show("worst-battery", battery ? withShortNames(`${battery.words} ${battery.name}`) : "–", battery?.level);
  text(byId("battery-lasts"), battery?.title ?? "worst battery");
  const oldest = oldestS();
  show("worst-age", Number.isFinite(oldest) ? seconds(oldest) : "–", Number.isNaN(oldest) ? "calm" : oldest > TOO_OLD_S ? "bad" : oldest > OLD_S ? "warn" : "good");
  show("recording", ...(replaying() ? ["–", ""] : recording()));
  text(byId("verdict"), replaying() ? store.scene.replay.note : withShortNames(verdict()));
  showStages();
}

// A stage that is done, the one now, and those to come; where there is no room, only the one now is shown.
function showStages() {
  const host = byId("stages"), now = STAGES.indexOf(stage()), words = STAGES.map(stageWord), key = `${now} ${words}`;
  if (host.dataset.key === key) return;
  host.dataset.key = key;
  host.replaceChildren(...words.map((word, index) => el("li", { class: index < now ? "done" : "", "aria-current": index === now ? "step" : null }, el("span", {}, word))));
}

export function startBar(resized) {
  const wall = byId("wall");
  const apply = (on) => { document.body.classList.toggle("wall", on); wall.setAttribute("aria-pressed", `${on}`); resized(); };
  const toggle = () => {
    const on = !document.body.classList.contains("wall");
    try { localStorage.setItem(WALL_KEY, on ? "1" : ""); } catch { /* it lasts until the page goes */ }
    apply(on);
  };
  try { apply(Boolean(localStorage.getItem(WALL_KEY))); } catch { apply(false); }
  wall.onclick = toggle;
  return toggle;
}
