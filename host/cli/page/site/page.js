// Keeps what the server tells, and draws it: at most once for each picture of the screen.

import { element, make } from "./elements.js";
import { Plane } from "./plane.js";
import { drawArray, drawBelief, drawIdentity, drawRobot, headline, numbersOfTouch, poseWords,
         truthWords } from "./panels.js";
import { view } from "./view.js";

const state = { setup: null, frame: null, touches: [], belief: null, next: null, maps: {},
                name: "Palpate" };
let paused = false;
let due = false;

function redraw() {
  if (!due) {
    due = true;
    requestAnimationFrame(() => {
      due = false;
      if (state.setup) draw();
    });
  }
}

const mm = ["x in the robot frame, mm", "y, mm"];
const planes = {
  array: new Plane(element("array"), null, redraw),
  robot: new Plane(element("robot"), mm, redraw),
  belief: new Plane(element("belief"), mm, redraw),
};

function draw() {
  drawArray(state, planes.array, element("array-caption"));
  drawRobot(state, planes.robot);
  drawBelief(state, planes.belief, element("turn"), element("belief-caption"));
  drawIdentity(state, element("identity"), element("identities"));
}

function tellTouch() {
  const last = state.touches.at(-1);
  const [decision, className] = !last ? ["waiting for the first touch", ""]
    : last.decision?.act ? ["Act", "act"] : ["Touch again", "wait"];
  Object.assign(element("decision"), { className, textContent: decision });
  element("headline").textContent = last ? headline(last) : "";
  element("pose").textContent = last ? poseWords(last) : "";
  element("because").textContent = last?.decision?.because ?? "";
  document.title = last ? `${last.best} ${Math.round(100 * last.identity[last.best])} %` : state.name;
  const words = last ? (last.words ?? [truthWords(last), ...(last.warnings ?? [])]) : [];
  element("words").replaceChildren(
    ...[state.next?.words, ...words].filter(Boolean).map((text) => make("li", {}, text)));
  element("numbers").replaceChildren(...(last ? numbersOfTouch(last) : []).flatMap(
    ([name, value]) => [make("dt", {}, name), make("dd", {}, value)]));
  tellTouches(last);
}

function tellTouches(last) {
  element("touches").replaceChildren(...Array.from(state.touches, (touch, i) => {
    if (!touch) return ""; // of so many touches the server keeps the last
    const out = last.left_out?.includes(i) ?? false;
    const item = make("li", { className: out ? "out" : "" },
                      `${touch.best} ${(100 * touch.identity[touch.best]).toFixed(0)} % `);
    if (state.setup.live) {
      const words = out ? "take in again" : "mark as bad";
      const onclick = () => ask({ do: "leave out", touch: i, out: !out });
      item.append(make("button", { "aria-label": `touch ${i + 1}: ${words}`, onclick }, words));
    }
    return item;
  }));
}

function tellFrame() {
  const { frame, setup } = state;
  const parts = [setup?.sensor ?? ""];
  if (frame.gone) parts.push("the board is unplugged; plug it in again to go on");
  else if (frame.taring) parts.push("taring: do not touch the array");
  else parts.push(frame.touching ? "touching" : "not touching");
  parts.push(`unknown ${frame.unknown + 1}, ${frame.touches} touches`);
  parts.push(`${frame.rate_hz} Hz, ${frame.frames} frames, ${frame.lost} lost`);
  if (frame.without_pose) parts.push(`${frame.without_pose} touches without a pose skipped`);
  if (frame.warning) parts.push(frame.warning);
  element("stream").textContent = parts.filter(Boolean).join(" · ");
  element("stream").className = frame.gone || frame.taring || frame.warning ? "warning" : "";
}

async function loadMap(index) {
  if (index === undefined || state.maps[index]) return;
  const answer = await fetch(`map/${index}`);
  if (answer.ok) {
    state.maps[index] = await answer.json();
    redraw();
  }
}

async function ask(request) {
  const answer = await fetch("do", { method: "POST", body: JSON.stringify(request) });
  if (!answer.ok) {
    element("connection").textContent = (await answer.text()).trim();
  }
}

function forget() {
  Object.assign(state, { touches: [], belief: null, next: null });
  tellTouch();
}

const on = {
  hello: forget, // a server that was started again tells all it has
  unknown: forget,
  files(files) {
    view(files, state, () => {
      tellTouch();
      redraw();
    });
  },
  setup(setup) {
    state.setup = setup;
    element("object").replaceChildren(...["most probable object", ...setup.maps].map(
      (name, i) => make("option", { value: i - 1 }, name)));
  },
  frame(frame) {
    state.frame = frame;
    tellFrame();
  },
  touch(touch) {
    state.next = null;
    state.touches[touch.touch] = touch;
    loadMap(touch.map);
    tellTouch();
  },
  next(next) {
    state.next = next;
    tellTouch();
  },
  belief(belief) {
    state.belief = belief;
    element("object").value = belief.chosen ? belief.map : -1;
  },
};

const events = new EventSource("events");
for (const [name, take] of Object.entries(on)) {
  events.addEventListener(name, (event) => {
    if (paused && name === "frame") return;
    take(JSON.parse(event.data));
    redraw();
  });
}
const tellConnection = (textContent, className) =>
  Object.assign(element("connection"), { textContent, className });
events.onopen = () => tellConnection("connected", "");
events.onerror = () => tellConnection("connection lost; trying again", "lost");

function pause() {
  paused = !paused;
  element("pause").setAttribute("aria-pressed", paused);
  element("pause").textContent = paused ? "Go on" : "Pause the picture";
}
function showAll() {
  Object.values(planes).forEach((plane) => plane.showAll());
}
const nextUnknown = () => state.setup?.live && ask({ do: "next unknown" });

element("object").onchange = (event) => ask({ do: "look at", object: Number(event.target.value) });
element("next-unknown").onclick = nextUnknown;
element("pause").onclick = pause;
element("fit-views").onclick = showAll;
document.addEventListener("keydown", (event) => {
  const keys = { n: nextUnknown, p: pause, 0: showAll };
  if (!event.ctrlKey && !event.metaKey && !["SELECT", "INPUT"].includes(event.target.tagName)) {
    keys[event.key]?.();
  }
});
new ResizeObserver(redraw).observe(document.body);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
