// Saved files: recordings row by row, maps, and tables of records.

import { element, make } from "./elements.js";

const columns = ["recording", "touches", "best", "probability", "truth", "error, mm", "fit", "act"];
const mostRows = 500; // of a table are drawn; the filter finds the others
const rowsAtOnce = 64; // as the server sends them

async function json(path) {
  const answer = await fetch(path);
  return answer.ok ? answer.json() : null;
}

/** Shows files and their content. `tell` draws the page's state. */
export function view(files, state, tell) {
  const choice = element("file");
  element("files-panel").hidden = false;
  choice.replaceChildren(...files.map(
    ({ name, kind }, i) => make("option", { value: i }, `${name} (${kind})`)));
  const open = async () => {
    const index = Number(choice.value);
    const file = await json(`file/${index}`);
    if (!file) return;
    Object.assign(state, nothing(), { maps: {}, name: files[index].name });
    state.setup = { sensor: "", pressure_unit: "", elements_mm: [], valid: [], labels: [], maps: [],
                    live: false };
    document.body.dataset.shows = file.kind;
    element("records").hidden = file.kind !== "records";
    element("scrub").hidden = true;
    await { recording: openRecording, map: openMap, records: openRecords }[file.kind](
      { index, file, state, tell });
  };
  choice.onchange = open;
  open();
}

const nothing = () => ({ frame: null, touches: [], belief: null, next: null });

function openMap({ file, state, tell }) {
  state.maps.alone = file;
  tell();
}

/** Lets the slider choose one of `count`; show(i) draws it and returns its words. */
async function scrub(count, first, show) {
  const row = element("row");
  element("scrub").hidden = false;
  row.max = count - 1;
  row.value = first;
  // Whoever drags sees the row where the slider is, and none that it has left meanwhile.
  let shown = null;
  let moving = false;
  const move = async () => {
    if (moving) return;
    moving = true;
    try {
      while (row.oninput === move && shown !== row.value) {
        shown = row.value;
        element("row-words").textContent = await show(Number(shown));
      }
    } finally {
      moving = false;
    }
  };
  row.oninput = move;
  await move();
}

async function openRecording({ index, file, state, tell }) {
  Object.assign(state.setup, { ...file, maps: [] });
  let part = null; // the rows that were asked for last
  const rowAt = async (i) => {
    const first = i - (i % rowsAtOnce);
    if (part?.first !== first) part = await json(`file/${index}/rows/${first}`);
    return { pressure: part.pressure[i - first], pose: part.pose[i - first],
             time: part.time && part.time[i - first] - file.begin_s };
  };
  await scrub(file.count, 0, async (i) => {
    const row = await rowAt(i);
    state.frame = { ...row, touching: true };
    tell();
    const words = row.pose.some((value) => value === null) ? "no pose"
      : `x ${row.pose[0].toFixed(2)} mm, y ${row.pose[1].toFixed(2)} mm, ` +
        `theta ${((180 / Math.PI) * row.pose[2]).toFixed(1)}°`;
    const time = row.time === undefined ? "" : `, ${row.time.toFixed(3)} s`;
    return `${file.rows === "frames" ? "frame" : "touch"} ${i + 1} of ${file.count}${time}, ${words}`;
  });
}

function openRecords({ index, file, state, tell }) {
  const filter = element("filter");
  let order = null; // {column, down}
  let chosen = 0;
  const numbers = file.rows.map((_, i) => i);
  const draw = () => {
    const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    const found = numbers.filter((i) => {
      const text = file.rows[i].join(" ").toLowerCase();
      return words.every((word) => text.includes(word));
    });
    if (order) {
      const sign = order.down ? -1 : 1;
      found.sort((a, b) => {
        const [x, y] = [file.rows[a][order.column], file.rows[b][order.column]];
        return sign * (typeof x === "number" && typeof y === "number"
          ? x - y : String(x ?? "").localeCompare(String(y ?? "")));
      });
    }
    element("shown").textContent = `${found.length} of ${file.rows.length} records` +
      (found.length > mostRows ? `, the first ${mostRows} shown` : "");
    element("records").querySelector("tbody").replaceChildren(
      ...found.slice(0, mostRows).map((i) => line(file.rows[i], i === chosen, () => choose(i))));
  };
  const choose = async (i) => {
    chosen = i;
    draw();
    await openRecord(await json(`file/${index}/record/${i}`),
                     await json(`file/${index}/map/${i}`), state, tell);
  };
  const sortBy = (column) => {
    order = { column, down: order?.column === column && !order.down };
    draw();
  };
  element("records").querySelector("thead tr").replaceChildren(...columns.map((name, column) =>
    make("th", {}, make("button", { onclick: () => sortBy(column) }, name))));
  filter.oninput = draw;
  draw();
  return file.rows.length ? choose(0) : undefined;
}

function line(values, chosen, choose) {
  const text = (value, column) =>
    typeof value === "number" && columns[column] !== "touches" ? value.toFixed(3)
      : value === true ? "act" : value === false ? "no" : (value ?? "");
  const onkeydown = (event) => { if (event.key === "Enter") choose(); };
  return make("tr", { tabIndex: 0, "aria-selected": chosen, onclick: choose, onkeydown },
              ...values.map((value, column) => make("td", {}, text(value, column))));
}

async function openRecord(record, map, state, tell) {
  Object.assign(state, nothing());
  element("scrub").hidden = true;
  if (!record.identity) { // it could not be recognised
    tell();
    return;
  }
  state.maps = map ? { 0: map } : {};
  Object.assign(state.setup, { labels: Object.keys(record.identity), elements_mm: [] });
  const steps = (record.trace ?? [record]).map((step) => ({
    ...step, truth: step.truth ?? record.truth,
    map: step.mode?.map === record.mode?.map ? 0 : undefined }));
  const show = (i) => {
    state.touches = steps.slice(0, i + 1);
    state.next = steps[i].next ?? null;
    tell();
    return `touch ${i + 1} of ${steps.length}`;
  };
  if (steps.length > 1) {
    await scrub(steps.length, steps.length - 1, show);
  } else {
    show(0);
  }
}
