// The figures over time: what they show, how they are drawn, saved, and made again in Python.
import { curvesOfOthers, dashOf, othersOf } from "./compare.js";
import { makeOrbits, setCursor, setMark, setView, setWindow, zoom } from "./cursor.js";
import { colours, faint, keep, keepPng, keepSvg, levelKeys, placeColour, svgPen, tracePicture } from "./figures.js";
import { clearPlots, drawOverview, drawPanel, follow, stripOn } from "./plots.js";
import * as server from "./server.js";
import { by, events, fileName, files, homeView, impacts, origin, samples, say, shift, showLines, span, state, uprights, usesEstimate, zero } from "./state.js";
import { make } from "./tables.js";
import * as units from "./units.js";

const component = (found, [x, y], signal) => (signal === "x" ? found[x] : signal === "r" ? found[x].map((v, i) => Math.hypot(v, found[y][i])) : found[y]);
const gapLevels = ([low, high], is, signal) => {
  const sides = signal === "r" ? [1] : signal === "x" ? [-1, 1] : [-1];
  return sides.flatMap((side) => (high - low > 1e-6 ? [side * low, side * high] : [side * high])).map((value) => ({ value, name: high - low > 1e-6 ? `air gap (${is})` : "air gap" }));
};

function motionPanel(index) {
  const verb = usesEstimate() ? "estimate" : "look", place = state[verb].places[index], signal = by("signal").value;
  const pairs = ["estimated", "measured"].filter((role) => place[role]).map((role) => [role, place[role]]);
  const columns = pairs.flatMap(([, names]) => names);
  const residual = signal === "residual" && place.residual;
  return {
    id: `motion ${index}`, verb, columns: residual ? [...columns, ...place.residual] : columns, kind: "length", fromZero: signal === "r",
    title: `${place.name}, ${verb === "estimate" ? "at the bearing" : "sensor plane"}`, others: residual ? [] : othersOf("motion", index, place.name),
    measured: pairs.map(([role, [x, y]]) => ({ label: `${place.name} ${role}`, column: residual ? null : { y, x, r: `${x}|${y}` }[signal] || y, value: (found) => component(found, [x, y], signal) })),
    axis: { y: "y", x: "x", r: "radius", residual: residual ? "measured − estimated" : "y" }[signal],
    levels: (place.gap && !residual) ? gapLevels(place.gap, place.gap_is, signal) : [],
    ofOther: (found, names) => component(found, names, signal),
    curves: (found, tone) => (residual
      ? place.residual.map((name, i) => ({ label: `residual ${"xy"[i]}`, colour: [tone.residual, tone.place2][i], values: found[name], dash: i ? [6, 3] : [] }))
      : pairs.map(([role, names]) => ({ label: place.labels?.[role] || role, colour: role === "estimated" ? faint(tone.estimated, 0.6) : tone.measured, width: role === "estimated" ? 3.5 : 1, values: component(found, names, signal) })))
  };
}

function loadPanel(kind) {
  const { places, panels } = state.estimate;
  return {
    id: kind, verb: "estimate", columns: places.flatMap((place) => place[kind]), kind: kind === "force" ? "force" : "pressure",
    title: kind === "force" ? "Bearing force" : "Maximum Hertz stress", axis: kind, fromZero: kind === "force",
    levels: panels[kind].flatMap((panel, i) => panel.levels.map(({ name, value }) => ({ name, value, place: i }))),
    measured: places.map((place) => ({ label: `${place.name} ${kind}`, column: place[kind][0], value: (found) => found[place[kind][0]] })),
    others: places.flatMap((place, i) => othersOf(kind, i, place.name)), ofOther: (found, [name]) => found[name],
    curves: (found, tone) => places.map((place, i) => ({
      label: `${place.name}, ${panels[kind][i].origin}`, colour: placeColour(tone, i), values: found[place[kind][0]],
      lower: place[kind][1] && found[place[kind][1]], upper: place[kind][2] && found[place[kind][2]], bandLabel: panels[kind][i].band
    }))
  };
}

// One figure of traces that somebody chose, of one quantity.
const KIND_OF = { m: "length", N: "force", Pa: "pressure", "rad/s": "speed" };
export function traces() {
  return ["look", "estimate"].filter((verb) => state[verb]).flatMap((verb) => Object.entries(state[verb].labels || {}).map(([column, label]) => {
    const [, name, unit] = label.match(/^(.*?)(?: \[(.*)\])?$/);
    return { key: `${verb} ${column}`, verb, column, kind: KIND_OF[unit], label: `${name}${column === "speed" ? ", as recorded" : verb === "look" ? ", sensor plane" : ", at the bearing"}` };
  })).filter((one) => one.kind);
}
function chosenPanel(title, id, list) {
  const [{ verb, kind }] = list;
  return { id, verb, kind, title, axis: { length: "motion", speed: "speed" }[kind] || kind, columns: list.map((one) => one.column), levels: [], others: [], fromZero: kind === "speed" && id === "speed",
    measured: list.map(({ label, column }) => ({ label: label.replace(/, .*/, ""), column, value: (found) => found[column] })), ofOther: (found, [name]) => found[name],
    curves: (found, tone) => list.map(({ label, column }, i) => ({ label, colour: placeColour(tone, i), values: found[column], dash: i > 3 ? [6, 3] : [] })) };
}
const speedPanel = () => chosenPanel("Shaft speed", "speed", [{ verb: "look", kind: "speed", column: "speed", label: "speed, as recorded" }]);

// A look has one motion for every sensor plane, an estimate one for every bearing: their numbers may differ.
export const FIGURES = () => [...state[usesEstimate() ? "estimate" : "look"].places.map((place, i) => [`motion ${i}`, `Motion ${place.name}`]),
  ...(state.estimate ? [["force", "Bearing force"], ["stress", "Maximum Hertz stress"]] : []), ...(state.look.traces.columns.includes("speed") ? [["speed", "Shaft speed"]] : [])];
const usual = (id) => id !== "speed" || !state.estimate;
export const isShown = (id) => (state.figures ? state.figures.includes(id) : usual(id));
// What is loaded: motion, force and stress always, for orbits and numbers at the cursor need them; of these and the rest, what is drawn.
function wanted() {
  const own = traces().filter((one) => state.own.includes(one.key)), same = own.filter((one) => one.kind === own[0].kind && one.verb === own[0].verb);
  const made = FIGURES().filter(([id]) => id !== "speed" || isShown(id)).map(([id]) => (id.startsWith("motion") ? motionPanel(Number(id.slice(7))) : id === "speed" ? speedPanel() : loadPanel(id)));
  return [...made, ...(same.length ? [chosenPanel("Chosen traces", "own", same)] : [])];
}

export async function loadView() {
  const serial = ++state.serial, asked = wanted(), { from, to } = state.view;
  const turning = state.look.traces.columns.includes("speed");
  let found, speed;
  try {
    [speed, ...found] = await Promise.all([turning ? samples("look", ["speed"], from, to, 400) : null,
      ...asked.map(async (panel) => ({ ...await samples(panel.verb, panel.columns, from, to), others: await curvesOfOthers(panel, from, to) }))]);
  } catch (error) { if (serial === state.serial) { say(error.message, "bad"); } return; }
  if (serial !== state.serial) { return; }
  state.speed = speed;
  state.loaded = asked.map((panel, i) => ({ ...panel, found: found[i], time: found[i].time }));
  state.orbits = state.loaded.filter((panel) => panel.id.startsWith("motion "));
  state.panels = state.loaded.filter(({ id }) => id === "own" || isShown(id));
  drawAll();
  document.dispatchEvent(new Event("seen"));
}

function key({ label, colour, lower, bandLabel, dash = [] }) {
  const mark = document.createElementNS("http://www.w3.org/2000/svg", "svg"), put = (name, told) => {
    const part = document.createElementNS(mark.namespaceURI, name);
    Object.entries(told).forEach(([what, value]) => part.setAttribute(what, value));
    mark.append(part);
  };
  if (lower) { put("rect", { width: 26, height: 8, fill: faint(colour, 0.3) }); }
  put("line", { x1: 0, x2: 26, y1: 4, y2: 4, stroke: colour, "stroke-width": 2.4, "stroke-dasharray": dash.join(" ") });
  mark.setAttribute("aria-hidden", "true");
  return make("span", { class: "key", of: [mark, make("span", { text: bandLabel ? `${label}, ${bandLabel}` : label })] });
}

function panelFrame(panel, tone) {
  panel.element = make("div", { class: "plot" });
  panel.drawn = [...panel.curves(panel.found, tone), ...panel.found.others.map(({ found, columns, k, label, place }) => ({
    label, dash: dashOf(k), width: 1.4, time: found.time, values: panel.ofOther(found, columns), colour: placeColour(tone, panel.kind === "length" ? k + 1 : place)
  }))];
  return make("section", { class: "panel", "aria-label": panel.title, of: [
    make("header", { of: [make("h2", { text: panel.title }), make("span", { class: "keys-of", of: [...panel.drawn, ...levelKeys(panel.levels, tone)].map(key) }), files(panel.title, {
      csv: () => csv(panel), svg: () => keepSvg(picture(panel), fileName(panel.title)), png: () => keepPng(picture(panel), fileName(panel.title)), python: lines(panel.verb, panel.id) && (() => showLines(lines(panel.verb, panel.id))), command: state[panel.verb].command && (() => showLines(state[panel.verb].command, "As command"))
    })] }), panel.element] });
}

function picture(panel) {
  const tone = colours(), pen = svgPen(900, 360, tone.back, panel.title), f = units.factor(panel.kind), [scale, name] = units.timeScale(state.view.to - state.view.from);
  const over = (array) => Float64Array.from(array, (v) => v / f), clock = (time) => time.map((t) => t / scale);
  const curves = panel.drawn.map((one) => ({ ...one, time: clock(one.time || panel.time), values: over(one.values) }));
  const bands = panel.drawn.filter((one) => one.lower).map((one) => ({ time: clock(panel.time), lower: over(one.lower), upper: over(one.upper), colour: faint(one.colour, 0.22) }));
  let low = panel.fromZero ? 0 : Infinity, high = -Infinity;
  for (const values of [...curves.map((one) => one.values), ...bands.map((one) => one.upper)]) {
    for (const v of values) { if (v < low) { low = v; } if (v > high) { high = v; } }
  }
  const room = 0.06 * (high - low || 1);
  tracePicture(pen, { title: `${state.job.name}: ${panel.title}`, curves, bands, levels: panel.levels.map((level) => ({ ...level, value: level.value / f })),
    uprights: uprights().map((one) => ({ ...one, at: one.time / scale })), x: { low: state.view.from / scale, high: state.view.to / scale, label: `time from ${origin()} [${name}]` },
    y: { low: panel.fromZero ? 0 : low - room, high: high + room, label: `${panel.axis} [${units.unit(panel.kind)}]` } });
  return pen;
}

// One table for this drop and one for every other: their clocks differ.
export async function csv(panel) {
  const own = panel.verb === "look" ? zero() : shift("estimate"), { from, to } = state.view;
  keep(await server.table(state.job.id, panel.verb, panel.columns, from + own, to + own), `${fileName(panel.title)}.csv`);
  const tables = new Map();
  for (const { other, verb, origin, columns } of panel.others) {
    tables.set(other.job, { verb, origin, columns: [...(tables.get(other.job)?.columns || []), ...columns], name: other.name });
  }
  for (const [job, { verb, origin, columns, name }] of tables) {
    keep(await server.table(job, verb, columns, from + origin, to + origin), `${fileName(`${panel.title} ${name}`)}.csv`);
  }
}

export const lines = (verb, figure) => [state[verb].python[figure], ...state.others.map((other) => {
  const told = (other.estimate || other.look)?.python[figure];
  return told ? `# ${other.name}\n${told}` : "";
})].filter(Boolean).join("\n");

export function drawAll() {
  const tone = colours();
  clearPlots();
  by("panels").replaceChildren(...state.panels.map((panel) => panelFrame(panel, tone)));
  by("panels").style.setProperty("--count", state.panels.length);
  for (const panel of state.panels) {
    drawPanel({ ...panel, curves: panel.drawn, lowest: panel === state.panels.at(-1) }, state.view, { origin: origin(), window: setWindow, cursor: setCursor, mark: setMark, uprights: uprights().map((one) => (panel === state.panels[0] ? one : { ...one, text: "" })), zoom, home: () => setView(homeView()) });
  }
  const [scale, name] = units.timeScale(state.view.to - state.view.from);
  by("from").value = Number((state.view.from / scale).toPrecision(6));
  by("to").value = Number((state.view.to / scale).toPrecision(6));
  by("timeunit").textContent = name;
  drawStrip();
  makeOrbits();
  requestAnimationFrame(() => follow(state.cursor));
}

const strip = () => ({ ...state.overview, origin: origin(), view: state.view, span: span(), impacts: impacts().map((one) => one.time),
  events: events(), uprights: uprights() });
export function drawStrip() { if (state.overview) { drawOverview(by("overview"), strip()); } }
const stripPicture = () => {
  const pen = svgPen(1200, 180, colours().back, `${state.job.name}: whole record`);
  stripOn(pen, strip());
  return pen;
};
by("stripfiles").replaceChildren(files("Whole record", {
  csv: async () => keep(await server.table(state.job.id, "look", state.look.places.map((place) => place.radius), state.look.traces.start, state.look.traces.end), `${fileName("whole record")}.csv`),
  svg: () => keepSvg(stripPicture(), fileName("whole record")), png: () => keepPng(stripPicture(), fileName("whole record")), python: () => showLines(lines("look", "overview"))
}));
