// Window and cursor: where they are, what is read at the cursor, and the orbits that follow it.
import { canvasPen } from "./figures.js";
import { drawOrbit, nearest } from "./orbit.js";
import { drawAll, drawStrip, loadView } from "./panels.js";
import { follow } from "./plots.js";
import { by, estimated, hits, span, state, zero } from "./state.js";
import { make } from "./tables.js";
import * as units from "./units.js";

function orbitOf(panel) {
  const { place, found, time } = panel, known = estimated(place.name), { gap, gap_is: gapIs } = known || place;
  const paths = ["estimated", "measured"].filter((role) => place[role]).map((role) => ({ role, time, x: found[place[role][0]], y: found[place[role][1]] }));
  const force = known && state.cursor !== null ? { value: loadAt("force", known.force[0]), largest: known.peak_force.value } : null;
  const turning = state.estimate ? state.estimate.speed : null;
  return { name: place.name, gap, gapIs, paths, cursor: state.cursor, force,
    impacts: hits().filter((one) => one.place === place.name && one.time >= state.view.from && one.time <= state.view.to).map((one) => one.azimuth),
    angle: turning && state.cursor !== null && state.view.to - state.view.from < 2 ? turning * state.cursor : null };
}
// Force or stress at the cursor; NaN where none is drawn there.
function loadAt(id, column) {
  const panel = state.panels.find((one) => one.id === id), at = state.cursor;
  return panel?.time.length && at !== null && at >= panel.time[0] && at <= panel.time.at(-1) ? panel.found[column][nearest(panel.time, at)] : NaN;
}

export function makeOrbits() {
  const names = state.orbits.map(({ place }) => place.name).join("\n"), box = by("orbits");
  if (box.dataset.names !== names) {
    box.dataset.names = names;
    box.replaceChildren(...state.orbits.map(() => make("figure", { class: "orbit", of: [make("canvas", { role: "img" })] })));
  }
  drawOrbits();
}

function drawOrbits() {
  [...by("orbits").querySelectorAll("canvas")].forEach((canvas, i) => {
    if (!state.orbits[i]) { return; }
    const told = orbitOf(state.orbits[i]);
    drawOrbit(canvasPen(canvas), told);
    canvas.setAttribute("aria-label", `Orbit at ${told.name} in its clearance circle, ${told.paths.map((one) => one.role).join(" and ")}, ${told.impacts.length} impacts in the window`);
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

function cellsOf({ found, place }, at) {
  const value = (name) => (found[name] && at !== null ? found[name][nearest(found.time, at)] : NaN);
  const role = place.estimated ? "estimated" : "measured", [x, y] = place[role].map(value), known = estimated(place.name);
  const order = at === null ? NaN : orderAt(found.time, ...place[role].map((name) => found[name]), at, speedAt(at));
  const cells = [units.written(x / units.factor("length"), 4), units.written(y / units.factor("length"), 4), overGap(Math.hypot(x, y), (known || place).gap),
    Number.isFinite(x) ? `${Math.round((Math.atan2(y, x) * 180) / Math.PI)}°`.replace("-", "−") : "–",
    Number.isFinite(order) ? `${units.fixed(order, 2)}X` : "–"];
  for (const [id, kind] of state.estimate ? [["force", "force"], ["stress", "pressure"]] : []) {
    const [now, low, high] = (known?.[id] || []).map((column) => loadAt(id, column) / units.factor(kind));
    cells.push(Number.isFinite(now) ? [units.written(now, 4), high === undefined ? "" : `${units.written(low, 3)} to ${units.written(high, 3)}`] : "–");
  }
  return cells;
}

function readout() {
  const at = state.cursor, speed = at === null ? NaN : speedAt(at);
  by("clock").textContent = at === null ? "point at a trace"
    : `${units.timeText(at, state.view.to - state.view.from)} · record ${units.fixed(at + zero(), 5)} s${speed > 0 ? ` · ${units.shown(speed, "speed", 4)}` : ""}`;
  const rows = state.orbits.map((panel) => make("tr", { of: [make("th", { scope: "row", text: panel.place.name }), ...cellsOf(panel, at).map((cell) => (Array.isArray(cell)
    ? make("td", { class: "number", of: [make("span", { text: cell[0] }), make("span", { class: "interval", text: cell[1] })] }) : make("td", { class: "number", text: cell })))] }));
  const of = (name, kind) => `${name} [${units.unit(kind)}]`;
  const columns = ["", of("x", "length"), of("y", "length"), "radius/gap", "angle", "order", ...(state.estimate ? [of("force", "force"), of("stress", "pressure")] : [])];
  const meant = { "radius/gap": "Distance from the centre over the air gap, at both ends of what is known of the gap", angle: "Angle on the ring, from +x", order: "Turns of the shaft centre per turn of the shaft, over half a turn of the shaft about the cursor; forward positive" };
  by("readhead").replaceChildren(make("tr", { of: columns.map((text, i) => make("th", { scope: "col", text, title: meant[text] || null, class: i ? "number" : null })) }));
  by("readout").replaceChildren(...rows);
  tellBetween();
}

// ---- two cursors: the mark, and what lies between it and the cursor

export function setMark(t) {
  state.mark = t;
  drawAll();
  drawOrbits();
  document.dispatchEvent(new Event("seen"));
}
const both = () => (state.mark === null || state.cursor === null || state.mark === state.cursor ? null : [Math.min(state.mark, state.cursor), Math.max(state.mark, state.cursor)]);

function tellBetween() {
  const ends = both(), box = by("between");
  by("unmark").hidden = state.mark === null;
  box.hidden = !ends;
  if (!ends) { return; }
  const apart = ends[1] - ends[0], speed = speedAt(ends[0]);
  const order = speed > 0 ? ` = ${units.fixed((2 * Math.PI) / apart / speed, 2)}X` : "", turns = speed > 0 ? `, ${units.fixed((apart * speed) / (2 * Math.PI), 2)} turns` : "";
  const rows = state.panels.flatMap((panel) => panel.measured.map(({ label, value }) => {
    const drawn = value(panel.found), [at, then] = [state.mark, state.cursor].map((t) => drawn[nearest(panel.time, t)] / units.factor(panel.kind));
    return make("tr", { of: [make("th", { scope: "row", text: `${label} [${units.unit(panel.kind)}]` }), ...[at, then, then - at].map((v) => make("td", { class: "number", text: units.written(v, 4) }))] });
  }));
  box.replaceChildren(make("caption", { text: `Mark to cursor: Δt ${units.timeText(apart, apart)}${turns}; 1/Δt ${units.written(1 / apart, 4)} Hz${order}` }),
    make("thead", { of: [make("tr", { of: ["", "mark", "cursor", "Δ"].map((text, i) => make("th", { scope: "col", text, class: i ? "number" : null })) })] }), make("tbody", { of: rows }));
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
  const { time } = state.orbits[0], here = state.cursor === null ? 0 : nearest(time, state.cursor);
  setCursor(time[Math.min(Math.max(here + direction, 0), time.length - 1)]);
}
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
