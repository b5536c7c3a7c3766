// The WebSocket: one seed, then what changed; comes back by itself, and asks for the token again when it does.

import { guarded } from "./guard.js";
import { asking, noteAnswer, roundTripMs, startClock } from "./server_clock.js";
import { store, takeDelta, takeSeed } from "./store.js";

const ACK_EVERY = 4, RETRY_MS = 300, RETRY_MAX_MS = 2000;
// For how long nothing may come: from a new connection, and from one that has spoken, which it does twenty times a second,
// on a slow link in as many parts as the server sends unanswered. The second leaves a stop that went into a dead
// connection time to be sent again while it is good.
const NEW_MS = 5000, SPOKEN_MS = 2500, PATIENCE_MAX_MS = 20000, BEAT_MS = 250;
const handlers = { seed: [], delta: [], notice: [], picture: [], state: [], welcome: [] };
// greeted: this connection has had its seed and its welcome. role: what this device may do: watch, stop or command.
export const me = { client: clientId(), name: "", trusted: false, greeted: false, role: "command" };

let socket = null, token = document.querySelector("meta[name=token]").content, retryMs = RETRY_MS, watched = [];
let newMs = NEW_MS, patienceMs = NEW_MS, quietMs = 0, early = [];

export const on = (kind, handler) => handlers[kind].push(handler);
const tell = (kind, ...content) => handlers[kind].forEach((handler, index) => guarded(index ? `${kind} ${index + 1}` : kind, () => handler(...content)));

function clientId() {
  try {
    const kept = sessionStorage.getItem("skein-client");
    if (kept) return kept;
  } catch { /* then the operator is another one after a reload */ }
  const fresh = [...crypto.getRandomValues(new Uint8Array(9))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  try { sessionStorage.setItem("skein-client", fresh); } catch { /* as above */ }
  return fresh;
}

// Returns whether the message went to the network; that is no promise that anybody heard it.
export function send(type, content = {}) {
  if (!socket || socket.readyState !== WebSocket.OPEN) return false;
  socket.send(JSON.stringify({ type, ...content }));
  return true;
}

export function watch(cameras) {
  watched = cameras;
  send("watch", { cameras });
}

export function connect() {
  socket = new WebSocket(`${location.protocol.replace("http", "ws")}//${location.host}/ws`);
  [patienceMs, quietMs, early] = [newMs, 0, []];
  startClock();
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    retryMs = RETRY_MS;
    send("hello", { token, client: me.client, sent_ms: asking() });
    if (watched.length) watch(watched);
  };
  socket.onmessage = ({ data }) => {
    quietMs = 0;
    if (me.greeted) [newMs, patienceMs] = [NEW_MS, SPOKEN_MS + roundTripMs()];
    return typeof data === "string" ? take(JSON.parse(data)) : takePicture(data);
  };
  socket.onclose = (event) => lost(event.reason);
}

// A connection that stalls is closed by nobody else. Told by the page's own beats: one that was frozen has no right to judge.
setInterval(() => {
  quietMs += BEAT_MS;
  if (socket && quietMs > patienceMs) abandon();
}, BEAT_MS);

function abandon() {
  const stalled = socket;
  stalled.onopen = stalled.onmessage = stalled.onclose = null; // a dead peer's answer to a close takes a minute
  stalled.close();
  waitLonger();
  lost("Nothing came through it any more");
}

const waitLonger = () => { newMs = Math.min(PATIENCE_MAX_MS, 2 * newMs); };

async function lost(reason = "") {
  socket = null;
  me.greeted = false;
  Object.assign(store, { connected: false, reason });
  tell("state");
  const again = () => { retryMs = Math.min(RETRY_MAX_MS, retryMs * 1.5); setTimeout(reconnect, retryMs); };
  again();
}

async function reconnect() {
  try {
    // The process may be another one by now, with another token.
    const answer = await fetch("/token", { cache: "no-store", signal: AbortSignal.timeout(newMs) });
    if (answer.ok) token = await answer.text();
  } catch (error) {
    if (error.name === "TimeoutError") waitLonger();
    return lost();
  }
  connect();
}

const answer = (seq) => send("seen", { seq, sent_ms: asking() });

function take(message) {
  // How old the first frames are is known once the server has answered.
  if (!me.greeted && ["seed", "delta"].includes(message.type)) return early.push(message);
  switch (message.type) {
    case "seed":
      takeSeed(message);
      answer(message.seq); // a replay that jumps sends seeds only
      store.connected = true;
      tell("seed"); tell("state");
      break;
    case "delta": {
      const sampled = takeDelta(message);
      if (message.answer) noteAnswer(...message.answer);
      if (watched.length || message.seq % ACK_EVERY === 0) answer(message.seq); // pictures wait for it
      tell("delta", message.s, sampled);
      break;
    }
    case "welcome":
      Object.assign(me, { name: message.name, trusted: message.trusted, role: message.role, greeted: true });
      if (message.answer) noteAnswer(...message.answer);
      early.splice(0).forEach(take);
      tell("welcome"); tell("state");
      break;
    case "notice":
      tell("notice", message);
  }
}

function takePicture(data) {
  const size = new DataView(data).getUint16(0);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 2, size)));
  tell("picture", head, new Uint8Array(data, 2 + size));
}
