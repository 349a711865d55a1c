// The figures over time: what they show, and how they are drawn and saved.
import { makeOrbits, setCursor, setMark, setView, setWindow, zoom } from "./cursor.js";
import { colours, faint, keep, levelKeys, placeColour } from "./figures.js";
import { clearPlots, drawOverview, drawPanel, follow } from "./plots.js";
import * as server from "./server.js";
import { by, estimated, events, fileName, hits, homeView, origin, samples, say, shift, span, state, tried, usesEstimate, zero } from "./state.js";
import { make } from "./tables.js";
import * as units from "./units.js";

const component = (found, [x, y], signal) => (signal === "x" ? found[x] : signal === "r" ? found[x].map((v, i) => Math.hypot(v, found[y][i])) : found[y]);
const gapLevels = ([low, high], is, signal) => {
  const sides = signal === "r" ? [1] : signal === "x" ? [-1, 1] : [-1];
  return sides.flatMap((side) => (high - low > 1e-6 ? [side * low, side * high] : [side * high])).map((value) => ({ value, name: high - low > 1e-6 ? `air gap (${is})` : "air gap" }));
};

// A look has one motion for every sensor plane, an estimate one for every bearing: their numbers may differ.
function motionPanel(verb, place, index) {
  const signal = by("signal").value, { gap, gap_is: gapIs } = estimated(place.name) || place;
  const pairs = ["estimated", "measured"].filter((role) => place[role]).map((role) => [role, place[role]]);
  return {
    id: `motion ${index}`, verb, place, columns: pairs.flatMap(([, names]) => names), kind: "length", fromZero: signal === "r",
    title: `${place.name}, ${verb === "estimate" ? "at the bearing" : "sensor plane"}`,
    measured: pairs.map(([role, names]) => ({ label: `${place.name} ${role}`, value: (found) => component(found, names, signal) })),
    axis: signal === "r" ? "radius" : signal, levels: gap ? gapLevels(gap, gapIs, signal) : [],
    curves: (found, tone) => pairs.map(([role, names]) => ({ label: place.labels?.[role] || role, colour: role === "estimated" ? faint(tone.estimated, 0.6) : tone.measured, width: role === "estimated" ? 3.5 : 1, values: component(found, names, signal) }))
  };
}

function loadPanel(kind) {
  const { places, panels } = state.estimate;
  return {
    id: kind, verb: "estimate", load: true, columns: places.flatMap((place) => place[kind]), kind: kind === "force" ? "force" : "pressure",
    title: kind === "force" ? "Bearing force" : "Maximum Hertz stress", axis: kind, fromZero: kind === "force",
    levels: panels[kind].flatMap((panel, i) => panel.levels.map(({ name, value }) => ({ name, value, place: i }))),
    measured: places.map((place) => ({ label: `${place.name} ${kind}`, value: (found) => found[place[kind][0]] })),
    curves: (found, tone) => places.map((place, i) => ({
      label: `${place.name}, ${panels[kind][i].origin}`, colour: placeColour(tone, i), values: found[place[kind][0]],
      lower: place[kind][1] && found[place[kind][1]], upper: place[kind][2] && found[place[kind][2]], bandLabel: panels[kind][i].band
    }))
  };
}

const speedPanel = { id: "speed", verb: "look", kind: "speed", title: "Shaft speed", axis: "speed", columns: ["speed"], levels: [],
  measured: [{ label: "speed", value: (found) => found.speed }],
  curves: (found, tone) => [{ label: "as recorded", colour: tone.place0, values: found.speed }] };

function wanted() {
  const verb = usesEstimate() ? "estimate" : "look", turning = state.look.traces.columns.includes("speed");
  return [...(state.estimate ? [loadPanel("force"), loadPanel("stress")] : []), ...state[verb].places.map((place, i) => motionPanel(verb, place, i)), ...(turning && !state.estimate ? [speedPanel] : [])];
}

export async function loadView() {
  const serial = ++state.serial, asked = wanted(), { from, to } = state.view;
  const turning = state.look.traces.columns.includes("speed");
  let found, speed;
  try {
    [speed, ...found] = await Promise.all([turning ? samples("look", ["speed"], from, to, 400) : null, ...asked.map((panel) => samples(panel.verb, panel.columns, from, to))]);
  } catch (error) { if (serial === state.serial) { say(error.message, "bad"); } return; }
  if (serial !== state.serial) { return; }
  state.speed = speed;
  state.panels = asked.map((panel, i) => ({ ...panel, found: found[i], time: found[i].time }));
  state.orbits = state.panels.filter((panel) => panel.place);
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
  panel.drawn = panel.curves(panel.found, tone);
  return make("section", { class: panel.load ? "panel load" : "panel", "aria-label": panel.title, of: [
    make("header", { of: [make("h2", { text: panel.title }), make("span", { class: "keys-of", of: [...panel.drawn, ...levelKeys(panel.levels, tone)].map(key) }),
      make("button", { class: "link csv", text: "CSV", title: "Save every sample of the window as CSV", "aria-label": `Save ${panel.title} as CSV`, on: { click: () => tried(csv(panel)) } })] }), panel.element] });
}

async function csv(panel) {
  const own = panel.verb === "look" ? zero() : shift("estimate"), { from, to } = state.view;
  keep(await server.table(state.job.id, panel.verb, panel.columns, from + own, to + own), `${fileName(panel.title)}.csv`);
}

export function drawAll() {
  const tone = colours();
  clearPlots();
  by("panels").replaceChildren(...state.panels.map((panel) => panelFrame(panel, tone)));
  by("panels").style.setProperty("--count", state.panels.length);
  for (const panel of state.panels) {
    drawPanel({ ...panel, curves: panel.drawn, lowest: panel === state.panels.at(-1) }, state.view, { origin: origin(), window: setWindow, cursor: setCursor, mark: state.mark, setMark, zoom, home: () => setView(homeView()) });
  }
  const [scale, name] = units.timeScale(state.view.to - state.view.from);
  by("from").value = Number((state.view.from / scale).toPrecision(6));
  by("to").value = Number((state.view.to / scale).toPrecision(6));
  by("timeunit").textContent = name;
  drawStrip();
  makeOrbits();
  requestAnimationFrame(() => follow(state.cursor));
}

export function drawStrip() {
  if (!state.overview) { return; }
  drawOverview(by("overview"), { data: state.overview, origin: origin(), view: state.view, span: span(), impacts: hits().map((one) => one.time), events: events(), mark: state.mark });
}
