// Names as the page writes them: a long one without its middle, unless it would then look like another. Orders, events and
// cameras have it whole, and so has what a screen reader reads of a card.

const LONGEST = 20, HEAD = 10, TAIL = 9;
let short = [];

const cut = (name) => `${name.slice(0, HEAD)}…${name.slice(-TAIL)}`;

// A camera may be called like its drone and more: the longest names first, so that none is cut within another.
export function takeNames({ drones, targets, cameras }) {
  const names = [...drones.flatMap(({ name, camera }) => [name, camera?.name ?? name]), ...targets.map(({ name }) => name), ...cameras.map(({ name }) => name)];
  const long = [...new Set(names)].filter((name) => name.length > LONGEST).sort((a, b) => b.length - a.length);
  short = long.filter((name) => long.filter((other) => cut(other) === cut(name)).length === 1).map((name) => [name, cut(name)]);
}

export const withShortNames = (words) => short.reduce((text, [name, less]) => text.replaceAll(name, less), words);
