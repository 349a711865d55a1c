// Window and cursor: where they are, what is read at the cursor, and the orbits that follow it.
import { canvasPen, keepPng, keepSvg } from "./figures.js";
import { dashOf } from "./compare.js";
import { drawOrbit, nearest, orbitPicture } from "./orbit.js";
import { csv, drawAll, drawStrip, lines, loadView } from "./panels.js";
import { follow } from "./plots.js";
import * as server from "./server.js";
import { by, fileName, files, impacts, shift, showLines, span, state, zero } from "./state.js";
import { make } from "./tables.js";
import * as units from "./units.js";

const motions = () => state.orbits;

function orbitOf(index) {
  const panel = state.orbits[index], place = state[panel.verb].places[index], forcePanel = state.loaded.find((one) => one.id === "force");
  const paths = ["estimated", "measured"].filter((role) => place[role]).map((role) => ({ role, time: panel.time, x: panel.found[place[role][0]], y: panel.found[place[role][1]] }));
  const turn = by("orbitof").value === "window" ? null : turnBefore();
  if (turn) { return { name: place.name, gap: place.gap, gapIs: place.gap_is, paths: paths.map((one) => ofTurn(one, turn, by("orbitof").value === "1X")), others: [], cursor: state.cursor, force: null, impacts: [], angle: null, turn }; }
  const others = panel.found.others.map(({ found, columns: [x, y], k }) => ({ x: found[x], y: found[y], k, dash: dashOf(k) }));
  let force = null;
  if (forcePanel && panel.verb === "estimate" && state.cursor !== null) {
    force = { value: forcePanel.found[place.force[0]][nearest(forcePanel.time, state.cursor)], largest: place.peaks.force.value };
  }
  const turning = state.estimate ? state.estimate.speed : null;
  return { name: place.name, gap: place.gap, gapIs: place.gap_is, paths, others, cursor: state.cursor, force,
    impacts: impacts().filter((one) => one.place === place.name && one.time >= state.view.from && one.time <= state.view.to).map((one) => one.azimuth),
    angle: turning && state.cursor !== null && state.view.to - state.view.from < 2 ? turning * state.cursor : null };
}

// The turn of the shaft that ends at the cursor: from the passage of the mark before it where there is one, else by the speed.
function turnBefore() {
  const at = state.cursor ?? state.view.from, speed = speedAt(at), marks = (state.look.marks || []).map((time) => time - zero());
  const last = marks.findLastIndex((time) => time <= at);
  if (last > 0 && marks[last] - marks[last - 1] < 3) { return { from: marks[last - 1], to: marks[last], seen: true }; }
  return speed > 0 ? { from: at - (2 * Math.PI) / speed, to: at, seen: false } : null;
}
// Samples of one turn; for 1X what is left of them at once per turn about their mean, by least squares.
function ofTurn(path, { from, to, seen }, filtered) {
  const first = Math.max(nearest(path.time, from), 0), last = nearest(path.time, to), time = path.time.slice(first, last + 1), part = { ...path, time, x: path.x.slice(first, last + 1), y: path.y.slice(first, last + 1), seen };
  return filtered ? { ...part, x: once(time, part.x, from, to), y: once(time, part.y, from, to) } : part;
}
export function once(time, values, from, to) {
  const rows = Array.from(time, (t) => { const angle = (2 * Math.PI * (t - from)) / (to - from); return [1, Math.cos(angle), Math.sin(angle)]; }), m = [0, 1, 2].map((i) => [0, 1, 2, 3].map((j) => rows.reduce((sum, row, k) => sum + row[i] * (j < 3 ? row[j] : values[k]), 0)));
  for (let i = 0; i < 3; i += 1) { for (let k = 0; k < 3; k += 1) { if (k !== i) { const share = m[k][i] / m[i][i]; for (let j = i; j < 4; j += 1) { m[k][j] -= share * m[i][j]; } } } }
  const c = m.map((row, i) => row[3] / row[i]);
  return rows.map(([, a, b]) => c[0] + c[1] * a + c[2] * b);
}

export function makeOrbits() {
  const names = motions().map(({ verb }, i) => state[verb].places[i].name), box = by("orbits");
  if (box.dataset.names !== names.join("\n")) {
    box.dataset.names = names.join("\n");
    box.replaceChildren(...names.map((name, i) => {
      const title = `Orbit ${name}`;
      return make("figure", { class: "orbit", of: [make("canvas", { role: "img" }), make("header", { of: [files(title, {
        csv: () => csv({ ...state.orbits[i], title }), svg: () => keepSvg(orbitPicture(orbitOf(i)), fileName(title)),
        png: () => keepPng(orbitPicture(orbitOf(i)), fileName(title)), python: () => showLines(lines(state.orbits[i].verb, `orbit ${i}`)), command: () => showLines(state[state.orbits[i].verb].command, "As command")
      })] })] });
    }));
  }
  drawOrbits();
}

function drawOrbits() {
  [...by("orbits").querySelectorAll("canvas")].forEach((canvas, i) => {
    if (!motions()[i]) { return; }
    const told = orbitOf(i);
    drawOrbit(canvasPen(canvas), told);
    canvas.setAttribute("aria-label", `Orbit at ${told.name} in its clearance circle${told.turn ? `, one turn from ${units.eventText(told.turn.from)}` : ""}, ${told.paths.map((one) => one.role).join(" and ")}, ${told.impacts.length} impacts in the window`);
  });
  readout();
}

// Shaft speed [rad/s] at a time: as recorded, or that of the estimate.
function speedAt(t) {
  const { speed } = state, found = speed && speed.time.length ? speed.speed[nearest(speed.time, t)] : NaN;
  return Number.isFinite(found) ? found : state.estimate?.speed ?? state.look.speed ?? NaN;
}

// Turns of the shaft centre round the middle per turn of the shaft, over half a turn of the shaft about a time: forward
// positive. Where samples were left out, or such a time lies outside the window, it is not known.
export function orderAt(time, x, y, t, speed) {
  const half = Math.PI / 2 / speed, first = nearest(time, t - half), last = nearest(time, t + half);
  if (!(speed > 0) || last - first < 16 || time[first] > t - 0.9 * half || time[last] < t + 0.9 * half) { return NaN; }
  let turned = 0;
  for (let i = first + 1; i <= last; i += 1) {
    const step = Math.atan2(x[i - 1] * y[i] - y[i - 1] * x[i], x[i - 1] * x[i] + y[i - 1] * y[i]);
    if (Math.abs(step) > 2) { return NaN; }
    turned += step;
  }
  return turned / (speed * (time[last] - time[first]));
}

// Radius over air gap: as sure as the gap is known.
export const overGap = (radius, gap) => (gap && Number.isFinite(radius) ? [...new Set([gap[1], gap[0]].map((one) => units.written(radius / one, 3)))].join(" to ") : "–");

function cellsOf({ verb, found }, place, at) {
  const value = (from, name) => (from[name] ? from[name][nearest(from.time, at)] : NaN);
  const role = place.estimated ? "estimated" : "measured", [x, y] = at === null ? [NaN, NaN] : place[role].map((name) => value(found, name));
  const order = at === null ? NaN : orderAt(found.time, ...place[role].map((name) => found[name]), at, speedAt(at));
  const cells = [units.written(x / units.factor("length"), 4), units.written(y / units.factor("length"), 4), overGap(Math.hypot(x, y), place.gap),
    Number.isFinite(x) ? `${Math.round((Math.atan2(y, x) * 180) / Math.PI)}°`.replace("-", "−") : "–",
    Number.isFinite(order) ? `${units.fixed(order, 2)}X` : "–"];
  for (const [id, name, kind] of state.estimate ? [["force", "force", "force"], ["stress", "stress", "pressure"]] : []) {
    const panel = state.loaded.find((one) => one.id === id), names = verb === "estimate" ? place[name] : [];
    const [now, low, high] = names.map((column) => (at !== null ? value(panel.found, column) / units.factor(kind) : NaN));
    cells.push(Number.isFinite(now) ? [units.written(now, 4), names[1] ? `${units.written(low, 3)} to ${units.written(high, 3)}` : ""] : "–");
  }
  return cells;
}

function readout() {
  const at = state.cursor, speed = at === null ? NaN : speedAt(at);
  by("clock").textContent = at === null ? "point at a trace"
    : `${units.timeText(at, state.view.to - state.view.from)} · record ${units.fixed(at + zero(), 5)} s${speed > 0 ? ` · ${units.shown(speed, "speed", 4)}` : ""}`;
  const rows = motions().map((panel, i) => {
    const place = state[panel.verb].places[i];
    return make("tr", { of: [make("th", { scope: "row", text: place.name }), ...cellsOf(panel, place, at).map((cell) => (Array.isArray(cell)
      ? make("td", { class: "number", of: [make("span", { text: cell[0] }), make("span", { class: "interval", text: cell[1] })] }) : make("td", { class: "number", text: cell })))] });
  });
  const of = (name, kind) => `${name} [${units.unit(kind)}]`;
  const columns = ["", of("x", "length"), of("y", "length"), "radius/gap", "angle", "order", ...(state.estimate ? [of("force", "force"), of("stress", "pressure")] : [])];
  const meant = { "radius/gap": "Distance from the centre over the air gap, at both ends of what is known of the gap", angle: "Angle on the ring, from +x", order: "Turns of the shaft centre per turn of the shaft, over half a turn of the shaft about the cursor; forward positive" };
  by("readhead").replaceChildren(make("tr", { of: columns.map((text, i) => make("th", { scope: "col", text, title: meant[text] || null, class: i ? "number" : null })) }));
  by("readout").replaceChildren(...rows);
  tellBetween();
}

// ---- two cursors: what lies between the mark and the cursor, of every sample

let asking = 0;
export function setMark(t) {
  state.mark = t;
  state.between = null;
  drawAll();
  drawOrbits();
  document.dispatchEvent(new Event("seen"));
}
const both = () => (state.mark === null || state.cursor === null || state.mark === state.cursor ? null : [Math.min(state.mark, state.cursor), Math.max(state.mark, state.cursor)]);

async function askBetween() {
  const ends = both(), { id } = state.job;
  if (!ends) { return; }
  const found = await Promise.all(state.panels.map(({ verb, measured }) => {
    const columns = measured.map((one) => one.column), own = verb === "look" ? zero() : shift("estimate");
    return columns.every(Boolean) ? server.between(id, verb, columns, ends[0] + own, ends[1] + own).catch(() => null) : null;
  }));
  const now = both();
  if (state.job?.id === id && now && now[0] === ends[0] && now[1] === ends[1]) { state.between = { ends, found }; tellBetween(); }
}

function tellBetween() {
  const ends = both(), box = by("between");
  by("unmark").hidden = state.mark === null;
  box.hidden = !ends;
  if (!ends) { return; }
  const apart = ends[1] - ends[0], speed = speedAt(ends[0]), known = state.between && state.between.ends[0] === ends[0] && state.between.ends[1] === ends[1] ? state.between.found : null;
  if (!known) { clearTimeout(asking); asking = setTimeout(() => askBetween().catch(() => {}), 200); }
  const order = speed > 0 ? ` = ${units.fixed((2 * Math.PI) / apart / speed, 2)}X` : "", turns = speed > 0 ? `, ${units.fixed((apart * speed) / (2 * Math.PI), 2)} turns` : "";
  const rows = state.panels.flatMap((panel, i) => panel.measured.map(({ label, value }, k) => {
    const drawn = value(panel.found), f = units.factor(panel.kind), at = (t) => drawn[nearest(panel.time, t)] / f, told = known?.[i]?.[k];
    const cell = (v) => make("td", { class: "number", text: units.written(v, 4) });
    return make("tr", { of: [make("th", { scope: "row", text: `${label} [${units.unit(panel.kind)}]` }), cell(at(state.mark)), cell(at(state.cursor)), cell(at(state.cursor) - at(state.mark)),
      ...["mean", "least", "largest"].map((name) => (told && told[name] !== null ? cell(told[name] / f) : make("td", { class: "number", text: known ? "–" : "…" })))] });
  }));
  box.replaceChildren(make("caption", { text: `Mark to cursor: Δt ${units.timeText(apart, apart)}${turns}; 1/Δt ${units.written(1 / apart, 4)} Hz${order}` }),
    make("thead", { of: [make("tr", { of: ["", "mark", "cursor", "Δ", "mean", "least", "largest"].map((text, i) => make("th", { scope: "col", text, class: i ? "number" : null })) })] }), make("tbody", { of: rows }));
}

// ---- where window and cursor are

export function setView({ from, to }) {
  const [first, last] = span(), least = 1e-4, width = Math.min(Math.max(to - from, least), last - first);
  const begin = Math.min(Math.max(from, first), last - width);
  state.view = { from: begin, to: begin + width };
  drawStrip();
  loadView();
}
export const setWindow = (from, to) => setView({ from: Math.min(from, to), to: Math.max(from, to) });
export function zoom(share, about) {
  const { from, to } = state.view, centre = about ?? (state.cursor !== null && state.cursor > from && state.cursor < to ? state.cursor : (from + to) / 2);
  setView({ from: centre + share * (from - centre), to: centre + share * (to - centre) });
}
export const pan = (direction) => { const by4 = ((state.view.to - state.view.from) / 4) * direction; setView({ from: state.view.from + by4, to: state.view.to + by4 }); };
export function setCursor(t) { state.cursor = t; drawOrbits(); follow(t); if (state.playing === null) { document.dispatchEvent(new Event("seen")); } }
export function stepCursor(direction) {
  const { time } = state.loaded[0], here = state.cursor === null ? 0 : nearest(time, state.cursor);
  setCursor(time[Math.min(Math.max(here + direction, 0), time.length - 1)]);
}
export const nextImpact = (direction) => {
  if (state.impact >= 0) { return state.impact + direction; }
  const list = impacts(), at = state.cursor ?? state.view.from;
  return direction > 0 ? Math.max(0, list.findIndex((one) => one.time > at)) : list.findLastIndex((one) => one.time < at);
};

export function play(on) {
  by("play").setAttribute("aria-pressed", String(on));
  by("play").textContent = on ? "❚❚ pause" : "▶ play";
  state.playing = on ? performance.now() : null;
  if (on) { requestAnimationFrame(frame); }
}
function frame(now) {
  if (state.playing === null) { return; }
  const { from, to } = state.view, step = (now - state.playing) / 1000 / Number(by("slower").value);
  state.playing = now;
  const t = (state.cursor === null || state.cursor < from || state.cursor > to ? from : state.cursor) + step;
  setCursor(t > to ? from : t);
  requestAnimationFrame(frame);
}

const overview = by("overview");
let grabbed = null;
const timeAt = (event) => { const [first, last] = span(); return first + (event.offsetX / overview.clientWidth) * (last - first); };
overview.addEventListener("pointerdown", (event) => { grabbed = timeAt(event); overview.setPointerCapture(event.pointerId); });
overview.addEventListener("pointerup", (event) => {
  if (grabbed === null) { return; }
  const until = timeAt(event), wide = Math.abs(until - grabbed) > 0.004 * (span()[1] - span()[0]), half = (state.view.to - state.view.from) / 2;
  if (wide) { setWindow(grabbed, until); } else { setView({ from: until - half, to: until + half }); }
  grabbed = null;
});
for (const id of ["from", "to"]) {
  by(id).addEventListener("change", () => {
    const [scale] = units.timeScale(state.view.to - state.view.from), [from, to] = ["from", "to"].map((name) => scale * Number(by(name).value.replace(",", ".").replace("−", "-")));
    if (Number.isFinite(from) && to > from) { setWindow(from, to); }
  });
}
