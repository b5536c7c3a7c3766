// The theme, and the colours that come with the scene: those of robots, targets and fence are the same in every view.

const INK = {
  light: { text: "#16202a", dim: "#5a6875", grid: "#dfe5ea", axis: "#9aa7b3", floor: "#fafbfc", outside: "#e3e8ed", link: "#4a5a68", truth: "#7a1fa2", halo: "#ffffff", band: "#00694d" },
  dark: { text: "#e7edf3", dim: "#93a4b3", grid: "#223140", axis: "#5d7081", floor: "#131d26", outside: "#0b1117", link: "#a9bac8", truth: "#d9a3f0", halo: "#0b1117", band: "#57d3a6" },
};
const KEY = "skein-theme";
let colours = {}, fence = {}, again = new Set();

export const theme = () => document.documentElement.dataset.theme;
export const ink = () => INK[theme()];
export function takeColours(scene) {
  [colours, fence] = [scene.colours, scene.fence_colour];
  const shades = scene.drones.map(({ name }) => colours[name].light);
  again = new Set(scene.drones.filter((_, index) => shades.indexOf(shades[index]) < index).map(({ name }) => name));
}

// Whether a drone before it has its colour: then its signs differ.
export const isAgain = (name) => again.has(name);
export const colourOf = (name) => colours[name]?.[theme()] ?? ink().text;
// In a picture, whose own light does not follow the theme, within a black edge.
export const colourInPicture = (name) => colours[name]?.dark ?? INK.dark.text;
export const fenceColour = () => fence[theme()];

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
