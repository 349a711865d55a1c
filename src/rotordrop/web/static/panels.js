// The figures over time: what they show, how they are drawn, saved, and made again in Python.
import { curvesOfOthers, dashOf, othersOf } from "./compare.js";
import { makeOrbits, setCursor, setView, setWindow, zoom } from "./cursor.js";
import { colours, faint, keep, keepPng, keepSvg, placeColour, svgPen, tracePicture } from "./figures.js";
import { clearPlots, drawOverview, drawPanel, follow, stripOn } from "./plots.js";
import * as server from "./server.js";
import { by, events, fileName, files, homeView, impacts, samples, say, shift, showLines, span, state, usesEstimate, zero } from "./state.js";
import { make } from "./tables.js";
import * as units from "./units.js";

const component = (found, [x, y], signal) => (signal === "x" ? found[x] : signal === "r" ? found[x].map((v, i) => Math.hypot(v, found[y][i])) : found[y]);
const gapLevels = ([low, high], signal) => {
  const sides = signal === "r" ? [1] : signal === "x" ? [-1, 1] : [-1];
  return sides.flatMap((side) => (high - low > 1e-6 ? [[side * low, ""], [side * high, "air gap"]] : [[side * high, "air gap"]])).map(([value, name]) => ({ value, name }));
};

function motionPanel(index) {
  const verb = usesEstimate() ? "estimate" : "look", place = state[verb].places[index], signal = by("signal").value;
  const pairs = ["estimated", "measured"].filter((role) => place[role]).map((role) => [role, place[role]]);
  const columns = pairs.flatMap(([, names]) => names);
  const residual = signal === "residual" && place.residual;
  return {
    id: `motion ${index}`, verb, columns: residual ? [...columns, ...place.residual] : columns, kind: "length", fromZero: signal === "r",
    title: `${place.name}, ${verb === "estimate" ? "at the bearing" : "sensor plane"}`, others: residual ? [] : othersOf("motion", index, place.name),
    axis: { y: "y", x: "x", r: "radius", residual: residual ? "measured − estimated" : "y" }[signal],
    levels: (place.gap && !residual) ? gapLevels(place.gap, signal) : [],
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
    levels: panels[kind].flatMap((panel, i) => panel.levels.map(({ name, value }) => ({ name: `${panel.title}: ${name}`, value, place: i }))),
    others: places.flatMap((place, i) => othersOf(kind, i, place.name)), ofOther: (found, [name]) => found[name],
    curves: (found, tone) => places.map((place, i) => ({
      label: `${place.name}, ${panels[kind][i].origin}`, colour: placeColour(tone, i), values: found[place[kind][0]],
      lower: place[kind][1] && found[place[kind][1]], upper: place[kind][2] && found[place[kind][2]], bandLabel: panels[kind][i].band
    }))
  };
}

// A look has one motion for every sensor plane, an estimate one for every bearing: their numbers may differ.
const wanted = () => [...state[usesEstimate() ? "estimate" : "look"].places.map((_, i) => motionPanel(i)), ...(state.estimate ? ["force", "stress"].map(loadPanel) : [])];

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
  state.panels = asked.map((panel, i) => ({ ...panel, found: found[i], time: found[i].time }));
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
    make("header", { of: [make("h2", { text: panel.title }), make("span", { class: "keys-of", of: panel.drawn.map(key) }), files(panel.title, {
      csv: () => csv(panel), svg: () => keepSvg(picture(panel), fileName(panel.title)), png: () => keepPng(picture(panel), fileName(panel.title)), python: () => showLines(lines(panel.verb, panel.id))
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
    x: { low: state.view.from / scale, high: state.view.to / scale, label: `time from power-off [${name}]` },
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
  for (const panel of state.panels) {
    drawPanel({ ...panel, curves: panel.drawn, lowest: panel === state.panels.at(-1) }, state.view, { window: setWindow, cursor: setCursor, zoom, home: () => setView(homeView()) });
  }
  const [scale, name] = units.timeScale(state.view.to - state.view.from);
  by("from").value = Number((state.view.from / scale).toPrecision(6));
  by("to").value = Number((state.view.to / scale).toPrecision(6));
  by("timeunit").textContent = name;
  drawStrip();
  makeOrbits();
  requestAnimationFrame(() => follow(state.cursor));
}

const strip = () => ({ ...state.overview, view: state.view, span: span(), impacts: impacts().map((one) => one.time),
  events: events() });
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
