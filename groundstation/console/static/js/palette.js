// Colours of entities (Okabe and Ito 2008), the same in every panel, and the theme.

const ROBOTS = {
  light: ["#0072b2", "#c05a00", "#00805d", "#a8407c", "#3a86c0", "#8a6d00"],
  dark: ["#56b4e9", "#f0a030", "#2fd09f", "#e493bf", "#9ad3f5", "#f0e442"],
};
const INK = {
  light: { text: "#16202a", dim: "#5a6875", grid: "#dfe5ea", axis: "#9aa7b3", floor: "#fafbfc", outside: "#e3e8ed", fence: "#b3261e", link: "#4a5a68", truth: "#7a1fa2", target: "#16202a", halo: "#ffffff", band: "#00694d", search: "#d55e00" },
  dark: { text: "#e7edf3", dim: "#93a4b3", grid: "#223140", axis: "#5d7081", floor: "#131d26", outside: "#0b1117", fence: "#ff8a80", link: "#a9bac8", truth: "#d9a3f0", target: "#ffffff", halo: "#0b1117", band: "#57d3a6", search: "#ff9d5c" },
};
const KEY = "skein-theme";
let names = [];

export const theme = () => document.documentElement.dataset.theme;
export const ink = () => INK[theme()];
export function nameRobots(list) { names = list; }

export function colourOf(name) {
  const index = names.indexOf(name);
  return index < 0 ? ink().target : ROBOTS[theme()][index % ROBOTS.light.length];
}

export function startTheme(changed) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const apply = (value) => { document.documentElement.dataset.theme = value; changed(); };
  let kept = null;
  try { kept = localStorage.getItem(KEY); } catch { /* storage may be forbidden */ }
  apply(kept ?? (system.matches ? "dark" : "light"));
  system.addEventListener("change", (event) => { if (!kept) apply(event.matches ? "dark" : "light"); });
  return () => {
    kept = theme() === "dark" ? "light" : "dark";
    try { localStorage.setItem(KEY, kept); } catch { /* it lasts until the page goes */ }
    apply(kept);
  };
}
