// What each panel draws of the page's state.

import { make } from "./elements.js";
import { imageOf, placed, prepare, rgba, theme } from "./plane.js";

// Radii of the ellipses that hold 68 and 95 % of a Gaussian over the plane.
const ellipses = [Math.sqrt(-2 * Math.log(1 - 0.68)), Math.sqrt(-2 * Math.log(1 - 0.95))];
const degrees = (rad) => (180 / Math.PI) * rad;
// Okabe and Ito's colours, told apart by every common kind of colour vision.
const series = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const noneColour = "#888888";

const percent = (p) => `${(100 * p).toFixed(p > 0.9995 || p < 0.0005 ? 0 : 1)} %`;
const colourOf = (state, label) =>
  label === "(none)" ? noneColour : series[state.setup.labels.indexOf(label) % series.length];

/** T_robot_object to act on, [x, y, theta]. */
const poseOfObject = (touch) => touch.refined?.T_robot_object ?? touch.T_robot_object;

export function headline(touch) {
  const unlike = touch.fit?.verdict === "does not fit" && touch.best !== "(none)" ? "unlike " : "";
  return `${unlike}${touch.best} (${percent(touch.identity[touch.best])})`;
}

export function poseWords(touch) {
  const pose = poseOfObject(touch);
  const sd = touch.refined?.sd;
  const value = (i, scale) =>
    (scale * pose[i]).toFixed(2) + (sd ? ` ± ${(scale * sd[i]).toFixed(2)}` : "");
  const turn = degrees(1);
  const of = touch.mode?.object ?? touch.best;
  const whose = of === touch.best ? "" : `pose of ${of}: `;
  return `${whose}x ${value(0, 1)} mm, y ${value(1, 1)} mm, theta ${value(2, turn)}°`;
}

export function truthWords(touch) {
  const error = touch.refined_error_mm ?? touch.error_mm;
  return touch.truth?.object
    ? `truth: ${touch.truth.object}${error == null ? "" : `; error ${error.toFixed(2)} mm`}` : "";
}

function numbersOf(text) {
  return text.split(",").map(Number);
}

/** The edge of an element's square: nine tenths of the way to the nearest other element. */
function elementEdge(elements) {
  const [first, ...others] = elements.length ? elements : [[0, 0]];
  const nearest = Math.min(2, ...others.map((e) => Math.hypot(e[0] - first[0], e[1] - first[1])));
  return 0.9 * nearest;
}

function square([x, y], edge) {
  const h = edge / 2;
  return [[x - h, y - h], [x + h, y - h], [x + h, y + h], [x - h, y + h]];
}

function boundsOf(places, margin) {
  const lower = [0, 1].map((i) => Math.min(...places.map((p) => p[i])) - margin);
  const upper = [0, 1].map((i) => Math.max(...places.map((p) => p[i])) + margin);
  return { lower, upper };
}

/** Draws lines, each from [u, v] to the next two. */
function strokeLines(context, ...lines) {
  context.beginPath();
  for (const [u, v, ...end] of lines) {
    context.moveTo(u, v);
    context.lineTo(...end);
  }
  context.stroke();
}

export function drawArray(state, plane, caption) {
  const { setup, frame } = state;
  if (!setup.elements_mm.length) {
    plane.begin();
    plane.end();
    caption.textContent = "no array is known";
    return;
  }
  const edge = elementEdge(setup.elements_mm);
  const { lower, upper } = boundsOf(setup.elements_mm, 0.7 * edge);
  plane.fit(lower, upper);
  const context = plane.begin();
  // The strongest colour: of a recording's pressures, or of five thresholds.
  const scale = setup.largest ?? Math.max(5 * setup.threshold, 1e-6);
  let dead = 0;
  setup.elements_mm.forEach((element, i) => {
    plane.polygon(square(element, edge));
    context.strokeStyle = theme("--line");
    context.stroke();
    const value = frame?.pressure?.[i];
    if (setup.valid.length && !setup.valid[i]) {
      ++dead;
      context.strokeStyle = theme("--soft");
      const [[u, v], r] = [plane.pixel(element), 0.3 * edge * plane.scale];
      strokeLines(context, [u - r, v - r, u + r, v + r], [u + r, v - r, u - r, v + r]);
    } else if (value === null) {
      context.fillStyle = theme("--soft");
      context.textAlign = "center";
      context.fillText("?", ...plane.pixel(element));
    } else if (value > 0) {
      context.fillStyle = rgba("--pressure", Math.min(1, value / scale));
      context.fill();
      if (value > (setup.threshold ?? Infinity)) {
        context.strokeStyle = theme("--contact");
        context.lineWidth = 1.5;
        context.stroke();
        context.lineWidth = 1;
      }
    }
  });
  plane.end();
  caption.textContent =
    `strongest colour ${Number(scale.toPrecision(3))} ${setup.pressure_unit}` +
    (setup.threshold ? `; framed: above the threshold of ${Number(setup.threshold.toPrecision(3))} ` +
                         setup.pressure_unit
                     : "") +
    (dead ? `; crossed: ${dead} dead` : "");
}

function imageOfMap(map) {
  const key = `${theme("--occupied")}|${theme("--free")}`;
  if (map.key !== key) {
    const [occupied, free] = [numbersOf(theme("--occupied")), numbersOf(theme("--free"))];
    map.key = key;
    map.image = imageOf(map.evidence, map.nx, map.ny, (byte) => {
      const part = (byte - 128) / 127;
      return [...(part > 0 ? occupied : free), 200 * Math.min(1, Math.abs(part))];
    });
  }
  return map.image;
}

/** The elements of the array at a pose, as squares in the robot frame. */
function footprint(state, pose, edge) {
  return state.setup.elements_mm.map((e) => square(e, edge).map((corner) => placed(pose, corner)));
}

function drawFootprint(state, plane, pose, { readings, dashed, colour }) {
  const edge = elementEdge(state.setup.elements_mm);
  const context = plane.context;
  context.setLineDash(dashed ? [4, 3] : []);
  context.strokeStyle = colour;
  footprint(state, pose, edge).forEach((corners, i) => {
    plane.polygon(corners);
    if (readings?.[i] === "C") {
      context.fillStyle = colour;
      context.globalAlpha *= 0.55;
      context.fill();
      context.globalAlpha /= 0.55;
    }
    context.stroke();
  });
  context.setLineDash([]);
}

const poseOf = (touch) => [touch.pose.x_mm, touch.pose.y_mm, touch.pose.theta_rad];
const known = (pose) => pose && pose.every((value) => value !== null);

export function drawRobot(state, plane) {
  const last = state.touches.at(-1);
  const now = known(state.frame?.pose) && state.frame.pose;
  const map = state.maps[last ? last.map : "alone"];
  const at = last ? poseOfObject(last) : [0, 0, 0];
  const touches = state.setup.elements_mm.length ? state.touches.filter((t) => t.pose) : [];
  const places = [];
  const edge = elementEdge(state.setup.elements_mm);
  const reach = (pose) => places.push(...footprint(state, pose, edge).flat());
  touches.forEach((touch) => reach(poseOf(touch)));
  (state.setup.reach ?? []).forEach(reach);
  if (map) {
    const [w, h] = [map.nx * map.cell_mm, map.ny * map.cell_mm];
    for (const corner of [[0, 0], [w, 0], [w, h], [0, h]]) {
      places.push(placed(at, corner.map((c, i) => c + map.lower_mm[i])));
    }
  } else if (last) {
    (last.modes ?? []).forEach((mode) => places.push(mode.T_robot_object));
  } else if (now) {
    reach(now);
  }
  if (places.length) {
    const { lower, upper } = boundsOf(places, 2);
    plane.fit(lower, upper);
  }
  const context = plane.begin();
  if (map) {
    plane.cells(imageOfMap(map), map.lower_mm, map.cell_mm, at);
  }
  touches.forEach((touch, i) => {
    const out = last.left_out?.includes(i);
    context.globalAlpha = out ? 0.15 : i === touches.length - 1 ? 0.9 : 0.35;
    drawFootprint(state, plane, poseOf(touch),
                  { readings: touch.readings, colour: theme("--contact"), dashed: out });
  });
  context.globalAlpha = 1;
  if (now && state.frame.touching) {
    drawFootprint(state, plane, now, { colour: rgba("--pressure", 0.9) });
  }
  if (state.next) {
    const { x_mm, y_mm, theta_rad } = state.next;
    drawFootprint(state, plane, [x_mm, y_mm, theta_rad], { colour: theme("--next"), dashed: true });
  }
  if (last) {
    drawModes(plane, last);
    drawTruth(plane, last);
  }
  plane.end();
}

function drawModes(plane, touch) {
  const context = plane.context;
  (touch.modes ?? []).forEach((mode, k) => {
    const [x, y] = mode.T_robot_object;
    context.strokeStyle = theme(k === 0 ? "--pose" : "--other");
    context.setLineDash(k === 0 ? [] : [5, 4]);
    context.lineWidth = 2;
    for (const radius of ellipses) {
      plane.ellipse([x, y], mode.covariance, radius);
      context.stroke();
    }
    context.setLineDash([]);
    const [u, v] = plane.pixel([x, y]);
    context.fillStyle = context.strokeStyle;
    context.textAlign = "left";
    // Beside the ellipse, with a halo, since the map lies below.
    const beside = u + 8 + ellipses[1] * Math.sqrt(mode.covariance[0][0]) * plane.scale;
    context.strokeStyle = theme("--ground");
    context.lineWidth = 3;
    const words = `${mode.object} ${percent(mode.probability)}`;
    context.strokeText(words, beside, v + 4);
    context.fillText(words, beside, v + 4);
    context.lineWidth = 1;
  });
}

function drawTruth(plane, touch) {
  const truth = touch.truth?.T_robot_object;
  if (!truth) return;
  const context = plane.context;
  const [u, v] = plane.pixel(truth);
  context.strokeStyle = theme("--truth");
  context.setLineDash([2, 2]);
  strokeLines(context, [u - 9, v, u + 9, v], [u, v - 9, u, v + 9]);
  context.setLineDash([]);
}

export function drawBelief(state, plane, turn, caption) {
  const { belief } = state;
  if (belief?.xy) {
    const side = belief.cells * belief.cell_mm;
    plane.fit(belief.lower_mm, belief.lower_mm.map((c) => c + side));
  }
  plane.begin();
  if (belief?.xy) {
    const colour = numbersOf(theme("--pressure"));
    const image = imageOf(belief.xy, belief.cells, belief.cells,
                          (byte) => [...colour, byte]);
    plane.cells(image, belief.lower_mm, belief.cell_mm);
    const last = state.touches.at(-1);
    if (last && last.map === belief.map) {
      drawModes(plane, { modes: (last.modes ?? []).slice(0, 1) });
      drawTruth(plane, last);
    }
    caption.textContent =
      `strongest colour ${percent(belief.peak)} of the object's belief in a cell of ` +
      `${Number(belief.cell_mm.toPrecision(2))} mm; each power of ten below it is a sixth paler`;
  } else {
    caption.textContent = belief ? "this object has no belief" : "";
  }
  plane.end();
  drawTurn(belief?.theta ?? [], turn);
}

function drawTurn(theta, canvas) {
  const context = prepare(canvas);
  const [left, bottom] = [46, 30];
  const [width, height] = [canvas.clientWidth - left - 8, canvas.clientHeight - bottom - 4];
  const peak = Math.max(...theta.map(([, p]) => p), 1e-300);
  context.fillStyle = rgba("--pressure", 0.9);
  const bar = Math.max(width / Math.max(theta.length, 1), 1);
  for (const [rad, p] of theta) {
    const u = left + (width * (rad + Math.PI)) / (2 * Math.PI);
    context.fillRect(u - bar / 2, 4 + height * (1 - p / peak), bar, (height * p) / peak);
  }
  context.fillStyle = theme("--soft");
  context.fillRect(left, 4 + height, width, 1);
  context.textAlign = "center";
  for (const deg of [-180, -90, 0, 90, 180]) {
    context.textAlign = deg === 180 ? "right" : "center";
    context.fillText(deg, left + (width * (deg + 180)) / 360, 18 + height);
  }
  context.textAlign = "center";
  context.fillText("theta of T_robot_object, degrees", left + width / 2, 31 + height);
}

export function drawIdentity(state, canvas, list) {
  const context = prepare(canvas);
  const [left, bottom] = [46, 18];
  const [width, height] = [canvas.clientWidth - left - 8, canvas.clientHeight - bottom - 8];
  const at = (i, p) => [left + (width * (i + 0.5)) / Math.max(state.touches.length, 4),
                        8 + height * (1 - p)];
  context.fillStyle = theme("--soft");
  context.textAlign = "right";
  for (const p of [0, 0.5, 1]) {
    const [, v] = at(0, p);
    context.fillText(`${100 * p} %`, left - 4, v + 4);
    context.fillRect(left, v, width, 0.5);
  }
  context.textAlign = "center";
  const every = Math.ceil(state.touches.length / 10) || 1;
  state.touches.forEach((_, i) => {
    if (i % every === 0) context.fillText(i + 1, at(i, 0)[0], 8 + height + 14);
  });
  for (const label of state.setup.labels) {
    context.strokeStyle = context.fillStyle = colourOf(state, label);
    context.lineWidth = 2;
    context.beginPath();
    state.touches.forEach((touch, i) => context.lineTo(...at(i, touch.identity[label])));
    context.stroke();
    state.touches.forEach((touch, i) => {
      context.beginPath();
      context.arc(...at(i, touch.identity[label]), 2.5, 0, 2 * Math.PI);
      context.fill();
    });
  }
  context.lineWidth = 1;
  const last = state.touches.at(-1);
  const sorted = [...state.setup.labels].sort(
    (a, b) => (last?.identity[b] ?? 0) - (last?.identity[a] ?? 0));
  list.replaceChildren(...sorted.slice(0, 12).map((label) => make(
    "li", {},
    make("span", { className: "swatch", style: `background: ${colourOf(state, label)}` }),
    last ? `${label} ${percent(last.identity[label])}` : label)));
}

/** Names and values of what is worth reading after a touch. */
export function numbersOfTouch(touch) {
  const rows = [];
  if (touch.fit) rows.push(["fit", `${touch.fit.verdict} (z ${touch.fit.z.toFixed(1)})`]);
  if (touch.none !== undefined) rows.push(["(none)", percent(touch.none)]);
  const ofLast = touch.touch_fit?.at(-1);
  if (typeof ofLast === "number") rows.push(["last touch's fit", `z ${ofLast.toFixed(1)}`]);
  if (touch.refined) {
    const [x, y, theta] = touch.refined.sd;
    rows.push(["sd", `${x.toFixed(2)} mm, ${y.toFixed(2)} mm, ${degrees(theta).toFixed(2)}°`]);
    rows.push(["near the pose", `${percent(touch.refined.share ?? 0)} of the belief`]);
  }
  if (touch.dropped_mass !== undefined) {
    rows.push(["unproven", touch.dropped_mass.toExponential(0)]);
  }
  rows.push(["latency", `${touch.latency_ms?.toFixed(1) ?? "-"} ms`]);
  return rows;
}
