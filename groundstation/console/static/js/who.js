// Who gave an order, in words for a person: this page's viewer is "you", the run's own program is its terminal.

import { me } from "./link.js";

const TERMINAL = "operator";

export const giver = (by) => (by === me.name ? "you" : by === TERMINAL ? "terminal" : by);

export const ordered = (by) => (by === TERMINAL ? "ordered at the terminal" : `ordered by ${giver(by)}`);
