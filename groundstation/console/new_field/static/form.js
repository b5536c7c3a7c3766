// The form of a new field: each change is sent, and the newest answer's drawing shown.
import { OFFERS } from "/offers.js";

const PAUSE_MS = 200;
const form = document.getElementById("form");
const fields = form.elements;
const list = document.getElementById("drones");
const note = document.getElementById("note");
const button = document.getElementById("write");
let number = 0;
let timer = 0;
let over = false;
const socket = new WebSocket(`ws://${location.host}/ws`);

function labelled(text, control) {
  const label = document.createElement("label");
  label.append(text, control);
  return label;
}

function input(value) {
  const made = document.createElement("input");
  Object.assign(made, { value, required: true, maxLength: 500 });
  return made;
}

function select() {
  const made = document.createElement("select");
  for (const [value, offer] of Object.entries(OFFERS)) made.append(new Option(offer.title, value));
  return made;
}

// Its address and pictures are those that its kind suggests, until somebody writes others.
function suggest(kind, address, pictures, usual) {
  const own = OFFERS[kind.value].address;
  const taken = [...list.querySelectorAll("input")].some((other) => other !== address && other.value === own);
  if (!address.dataset.own) address.value = own && !taken ? own : usual;
  if (pictures.dataset.own) return;
  pictures.value = OFFERS[kind.value].pictures.replace("{address}", address.value);
}

function drone(index) {
  const item = document.createElement("li");
  const [kind, address, pictures, usual] = [select(), input(""), input(""), `192.168.1.${11 + index}`];
  for (const each of [address, pictures]) each.addEventListener("input", () => { each.dataset.own = "1"; });
  for (const each of [kind, address]) each.addEventListener("input", () => suggest(kind, address, pictures, usual));
  suggest(kind, address, pictures, usual);
  item.append(labelled(`drone_${index + 1}`, kind), labelled("Its address", address), labelled("Its pictures", pictures));
  return item;
}

function fit() {
  const wanted = Math.min(9, Math.max(1, Number(fields.count.value) || 1));
  while (list.children.length > wanted) list.lastElementChild.remove();
  while (list.children.length < wanted) list.append(drone(list.children.length));
}

function answers(order) {
  const read = (name) => Number(fields[name].value);
  const drones = [...list.children].map((item) => [...item.querySelectorAll("select, input")].map((each) => each.value));
  return {
    number: ++number, order, drones,
    room: [read("room_length"), read("room_width"), read("room_height"), fields.ceiling.value],
    target: [fields.base.value, read("board")],
  };
}

function say(text, bad = false) {
  note.textContent = text;
  note.dataset.level = bad ? "bad" : "";
}

function send(order) {
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(answers(order)));
}

function changed() {
  fit();
  number += 1; // what is still on its way answers a form that is no more
  button.disabled = true;
  clearTimeout(timer);
  if (!form.checkValidity()) say("Fill in what is marked.", true);
  else timer = setTimeout(send, PAUSE_MS, "draw");
}

function show(reply) {
  if (reply.number !== number) return;
  say(reply.problem, Boolean(reply.problem));
  button.disabled = Boolean(reply.problem);
  document.getElementById("text").textContent = reply.text;
  document.getElementById("warnings").replaceChildren(...reply.warnings.map((text) => {
    const item = document.createElement("li");
    item.textContent = text;
    return item;
  }));
  const image = document.getElementById("room");
  if (reply.svg) {
    URL.revokeObjectURL(image.src);
    image.src = URL.createObjectURL(new Blob([reply.svg], { type: "image/svg+xml" }));
  }
  image.hidden = !reply.svg;
  if (reply.written) finish(reply.written);
}

function finish(path) {
  over = true;
  say(`Written: ${path}. Next, in the terminal: groundstation config check ${path}`);
  for (const each of fields) each.disabled = true;
}

form.addEventListener("input", (event) => {
  if (event.target === fields.base) fields.board.value = fields.base.selectedOptions[0].dataset.board;
  changed();
});
form.addEventListener("submit", (event) => { event.preventDefault(); button.disabled = true; send("write"); });
socket.addEventListener("open", changed);
socket.addEventListener("message", (event) => show(JSON.parse(event.data)));
socket.addEventListener("close", () => { if (!over) { button.disabled = true; say("No connection to the command in the terminal: nothing was written by this page. Reload it if the command still runs.", true); } });
fit();
