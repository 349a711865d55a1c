// The page: one job, one window, one cursor.
import * as server from "./server.js";
import { canvasPen, colours, faint, keep, keepPng, keepSvg, placeColour, svgPen, tracePicture } from "./figures.js";
import { drawOrbit, nearest, orbitPicture } from "./orbit.js";
import { clearPlots, drawOverview, drawPanel, follow } from "./plots.js";
import { cards, facts, findings, impactTable, make, sentence, table, timeline } from "./tables.js";
import { drawFall, fallFiles, openFall } from "./waterfall.js";
import * as units from "./units.js";

const by = (id) => document.getElementById(id);
const state = { job: null, look: null, estimate: null, view: null, cursor: null, impact: -1, tab: "Impacts", panels: [], overview: null, playing: null, serial: 0 };
const zero = () => (state.estimate || state.look).zero;
const span = () => { const { start, end } = state.look.traces; return [start - state.look.zero + shift("look"), end - state.look.zero + shift("look")]; };
const shift = (verb) => state[verb].zero - zero();
const homeView = () => (state.estimate ? { from: -0.005, to: state.estimate.traces.end }
  : { from: -0.02, to: Math.min(0.4, span()[1]) });
const usesEstimate = () => state.estimate && state.view.from >= -0.05 && state.view.to <= state.estimate.traces.end + 0.01;
const timeOf = (verb) => (t) => units.eventText(verb === "look" ? t - zero() : t);
const impacts = () => (state.estimate && state.estimate.impacts.length ? state.estimate.impacts
  : state.look.impacts.map((one) => ({ ...one, time: one.time - zero() })));

async function samples(verb, columns, from, to, points) {
  const own = verb === "look" ? zero() : shift("estimate");
  const found = await server.samples(state.job.id, verb, columns, from + own, to + own, points);
  found.time = found.time.map((t) => t - own);
  return found;
}

// ---- what is drawn

function motionPanel(index) {
  const verb = usesEstimate() ? "estimate" : "look", place = state[verb].places[index], signal = by("signal").value;
  const pairs = ["estimated", "measured"].filter((role) => place[role]).map((role) => [role, place[role]]);
  const columns = pairs.flatMap(([, names]) => names);
  const residual = signal === "residual" && place.residual;
  return {
    id: `motion ${index}`, verb, columns: residual ? [...columns, ...place.residual] : columns, kind: "length", fromZero: signal === "r",
    title: `${place.name}, ${verb === "estimate" ? "at the bearing" : "sensor plane"}`,
    axis: { y: "y", x: "x", r: "radius", residual: residual ? "measured − estimated" : "y" }[signal],
    levels: (place.gap && !residual) ? gapLevels(place.gap, signal) : [],
    curves: (found, tone) => (residual
      ? place.residual.map((name, i) => ({ label: `residual ${"xy"[i]}`, colour: [tone.residual, tone.place2][i], values: found[name] }))
      : pairs.map(([role, names]) => ({ label: place.labels?.[role] || role, colour: role === "estimated" ? faint(tone.estimated, 0.6) : tone.measured, width: role === "estimated" ? 3.5 : 1, values: component(found, names, signal) })))
  };
}

const component = (found, [x, y], signal) => (signal === "x" ? found[x] : signal === "r" ? found[x].map((v, i) => Math.hypot(v, found[y][i])) : found[y]);
const gapLevels = ([low, high], signal) => {
  const sides = signal === "r" ? [1] : signal === "x" ? [-1, 1] : [-1];
  return sides.flatMap((side) => (high - low > 1e-6 ? [[side * low, ""], [side * high, "air gap"]] : [[side * high, "air gap"]])).map(([value, name]) => ({ value, name }));
};

function loadPanel(kind) {
  const { places, panels } = state.estimate;
  return {
    id: kind, verb: "estimate", columns: places.flatMap((place) => place[kind]), kind: kind === "force" ? "force" : "pressure",
    title: kind === "force" ? "Bearing force" : "Maximum Hertz stress", axis: kind, fromZero: kind === "force",
    levels: panels[kind].flatMap((panel, i) => panel.levels.map(({ name, value }) => ({ name: `${panel.title}: ${name}`, value, place: i }))),
    curves: (found, tone) => places.map((place, i) => ({
      label: `${place.name}, ${panels[kind][i].origin}`, colour: placeColour(tone, i), values: found[place[kind][0]],
      lower: place[kind][1] && found[place[kind][1]], upper: place[kind][2] && found[place[kind][2]], bandLabel: panels[kind][i].band
    }))
  };
}

// A look has one motion for every sensor plane, an estimate one for every bearing: their numbers may differ.
const wanted = () => [...state[usesEstimate() ? "estimate" : "look"].places.map((_, i) => motionPanel(i)), ...(state.estimate ? ["force", "stress"].map(loadPanel) : [])];

async function loadView() {
  const serial = ++state.serial, asked = wanted();
  let found;
  try {
    found = await Promise.all(asked.map(({ verb, columns }) => samples(verb, columns, state.view.from, state.view.to)));
  } catch (error) { if (serial === state.serial) { say(error.message, "bad"); } return; }
  if (serial !== state.serial) { return; }
  state.panels = asked.map((panel, i) => ({ ...panel, found: found[i], time: found[i].time }));
  drawAll();
}

function panelFrame(panel, tone) {
  const key = ({ label, colour, lower, bandLabel }) => {
    const mark = document.createElementNS("http://www.w3.org/2000/svg", "svg"), stroke = document.createElementNS(mark.namespaceURI, "rect");
    Object.entries({ width: 18, height: lower ? 8 : 2.4, y: lower ? 0 : 3, fill: lower ? faint(colour, 0.3) : colour }).forEach(([name, value]) => stroke.setAttribute(name, value));
    const core = stroke.cloneNode(); Object.entries({ height: 2.4, y: 3, fill: colour }).forEach(([name, value]) => core.setAttribute(name, value));
    mark.append(stroke, core); mark.setAttribute("aria-hidden", "true");
    return make("span", { class: "key", of: [mark, make("span", { text: bandLabel ? `${label}, ${bandLabel}` : label })] });
  };
  const curves = panel.curves(panel.found, tone);
  panel.element = make("div", { class: "plot" });
  panel.drawn = curves;
  return make("section", { class: "panel", "aria-label": panel.title, of: [
    make("header", { of: [make("h2", { text: panel.title }), ...curves.map(key), files(panel.title, {
      csv: () => csv(panel), svg: () => keepSvg(picture(panel), fileName(panel)), png: () => keepPng(picture(panel), fileName(panel)), python: () => python(panel.verb, panel.id)
    })] }), panel.element] });
}

const files = (title, ways) => make("span", { class: "files", of: Object.entries({ CSV: ways.csv, SVG: ways.svg, PNG: ways.png, Python: ways.python })
  .map(([text, click]) => make("button", { text, "aria-label": `${title}: ${text === "Python" ? "as Python" : `save as ${text}`}`, on: { click } })) });
const fileName = (panel) => `${state.job.name} ${panel.title}`.replace(/[^\w.-]+/g, "_");

function picture(panel) {
  const tone = colours(), pen = svgPen(900, 360, tone.back, panel.title), f = units.factor(panel.kind), [scale, name] = units.timeScale(state.view.to - state.view.from);
  const time = panel.time.map((t) => t / scale), over = (array) => Float64Array.from(array, (v) => v / f);
  const curves = panel.drawn.map((one) => ({ ...one, time, values: over(one.values) }));
  const bands = panel.drawn.filter((one) => one.lower).map((one) => ({ time, lower: over(one.lower), upper: over(one.upper), colour: faint(one.colour, 0.22) }));
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

async function csv(panel) {
  const own = panel.verb === "look" ? zero() : shift("estimate");
  keep(await server.table(state.job.id, panel.verb, panel.columns, state.view.from + own, state.view.to + own), `${fileName(panel)}.csv`);
}

function python(verb, figure) {
  by("code").textContent = state[verb].python[figure];
  by("lines").showModal();
}

function drawAll() {
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

function drawStrip() {
  if (!state.overview) { return; }
  drawOverview(by("overview"), { ...state.overview, view: state.view, span: span(), impacts: impacts().map((one) => one.time),
    events: state.look.timeline.map(({ time, words }) => ({ time: time - zero(), words })) });
}

const motions = () => state.panels.filter((panel) => panel.id.startsWith("motion "));

function orbitOf(index) {
  const panel = state.panels[index], place = state[panel.verb].places[index], forcePanel = state.panels.find((one) => one.id === "force");
  const paths = ["estimated", "measured"].filter((role) => place[role]).map((role) => ({ role, time: panel.time, x: panel.found[place[role][0]], y: panel.found[place[role][1]] }));
  let force = null;
  if (forcePanel && panel.verb === "estimate" && state.cursor !== null) {
    force = { value: forcePanel.found[place.force[0]][nearest(forcePanel.time, state.cursor)], largest: place.peaks.force.value };
  }
  const turning = state.estimate ? state.estimate.speed : null;
  return { name: place.name, gap: place.gap, paths, cursor: state.cursor, force,
    impacts: impacts().filter((one) => one.place === place.name && one.time >= state.view.from && one.time <= state.view.to).map((one) => one.azimuth),
    angle: turning && state.cursor !== null && state.view.to - state.view.from < 2 ? turning * state.cursor : null };
}

function makeOrbits() {
  const names = motions().map(({ verb }, i) => state[verb].places[i].name), box = by("orbits");
  if (box.dataset.names !== names.join("\n")) {
    box.dataset.names = names.join("\n");
    box.replaceChildren(...names.map((name, i) => {
      const title = `Orbit ${name}`, named = { title };
      return make("figure", { class: "orbit", of: [make("canvas", { role: "img" }), make("header", { of: [files(title, {
        csv: () => csv(state.panels[i]), svg: () => keepSvg(orbitPicture(orbitOf(i)), fileName(named)),
        png: () => keepPng(orbitPicture(orbitOf(i)), fileName(named)), python: () => python(state.panels[i].verb, `orbit ${i}`)
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
    canvas.setAttribute("aria-label", `Orbit at ${told.name} in its clearance circle, ${told.paths.map((one) => one.role).join(" and ")}, ${told.impacts.length} impacts in the window`);
  });
  readout();
}

function readout() {
  const at = state.cursor, rows = [];
  by("clock").textContent = at === null ? "point at a trace" : `${units.timeText(at, state.view.to - state.view.from)} · record ${(at + zero()).toFixed(5)} s`;
  const value = (found, name) => (found[name] ? found[name][nearest(found.time, at)] : NaN);
  const force = state.panels.find((one) => one.id === "force"), stress = state.panels.find((one) => one.id === "stress");
  for (const [i, { verb, found }] of motions().entries()) {
    const place = state[verb].places[i], role = place.estimated ? "estimated" : "measured";
    const [x, y] = at === null ? [NaN, NaN] : place[role].map((name) => value(found, name));
    const cells = [units.shown(x, "length", 4), units.shown(y, "length", 4), place.gap ? units.written(Math.hypot(x, y) / place.gap[1], 3) : "–",
      Number.isFinite(x) ? `${Math.round((Math.atan2(y, x) * 180) / Math.PI)}°`.replace("-", "−") : "–"];
    if (state.estimate) {
      for (const [panel, kind] of [[force, "force"], [stress, "pressure"]]) {
        const names = verb === "estimate" ? place[kind === "force" ? "force" : "stress"] : [];
        const [now, low, high] = names.map((name) => (at !== null ? value(panel.found, name) / units.factor(kind) : NaN));
        cells.push(Number.isFinite(now) ? [`${units.written(now, 4)} ${units.unit(kind)}`, names[1] ? `${units.written(low, 3)} to ${units.written(high, 3)}` : ""] : "–");
      }
    }
    rows.push(make("tr", { of: [make("th", { scope: "row", text: place.name }), ...cells.map((cell) => (Array.isArray(cell)
      ? make("td", { class: "number", of: [make("span", { text: cell[0] }), make("span", { class: "interval", text: cell[1] })] }) : make("td", { class: "number", text: cell })))] }));
  }
  const columns = ["", "x", "y", "radius / gap", "ring angle", ...(state.estimate ? ["force", "stress"] : [])];
  by("readhead").replaceChildren(make("tr", { of: columns.map((text, i) => make("th", { scope: "col", text, class: i ? "number" : null })) }));
  by("readout").replaceChildren(...rows);
}

// ---- window and cursor

function setView({ from, to }) {
  const [first, last] = span(), least = 1e-4, width = Math.min(Math.max(to - from, least), last - first);
  const begin = Math.min(Math.max(from, first), last - width);
  state.view = { from: begin, to: begin + width };
  drawStrip();
  loadView();
}
const setWindow = (from, to) => setView({ from: Math.min(from, to), to: Math.max(from, to) });
function zoom(share, about) {
  const { from, to } = state.view, centre = about ?? (state.cursor !== null && state.cursor > from && state.cursor < to ? state.cursor : (from + to) / 2);
  setView({ from: centre + share * (from - centre), to: centre + share * (to - centre) });
}
function setCursor(t) { state.cursor = t; drawOrbits(); follow(t); }
function stepCursor(direction) {
  const { time } = state.panels[0], here = state.cursor === null ? 0 : nearest(time, state.cursor);
  setCursor(time[Math.min(Math.max(here + direction, 0), time.length - 1)]);
}
function goImpact(index) {
  const list = impacts();
  if (!list.length) { return; }
  state.impact = Math.min(Math.max(index, 0), list.length - 1);
  const { time } = list[state.impact];
  state.cursor = time;
  setView({ from: time - 0.006, to: time + 0.012 });
  showTab("Impacts");
  by("tabpanel").querySelector(".here")?.scrollIntoView({ block: "nearest" });
}
function play(on) {
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

// ---- what is written

const TABS = {
  Impacts: () => {
    const source = state.estimate && state.estimate.impacts.length ? state.estimate : state.look, list = impacts();
    return [...(list.length ? [impactTable(list.slice(0, 400), source.impact_columns, state.impact, timeOf("estimate"), goImpact)] : [make("p", { text: "No impacts." })]),
      make("span", { class: "files", of: [make("button", { text: "as Python", on: { click: () => python(source === state.look ? "look" : "estimate", "impacts") } })] })];
  },
  Events: () => [timeline(state.look.timeline, timeOf("look"), (time) => { const t = time - zero(); state.cursor = t; setView({ from: t - 0.05, to: t + 0.1 }); })],
  Numbers: () => {
    const page = state.estimate || state.look;
    return [cards(page.cards), make("ul", { class: "statements", of: page.verdict.map(sentence) }), ...(state.estimate ? page.summary : []).map(table)];
  },
  Quality: () => [findings(state.look.findings), ...(state.look.sections.at(-1)?.statements || []).map((one) => make("p", { class: "small", text: one.text }))],
  All: () => (state.estimate || state.look).sections.flatMap((part) => [make("h3", { class: "part", text: part.heading }),
    ...part.text.map((text) => make("p", { text })), make("ul", { class: "statements", of: part.statements.map(sentence) }), ...part.tables.map(table)]),
  Origin: () => [facts((state.estimate || state.look).facts), facts(Object.entries(state.job.files).map(([role, file]) => [role, `${file.name}, ${file.bytes} bytes, SHA-256 ${file.sha256}`]))]
};

function showTab(name, focus = false) {
  state.tab = name;
  by("tabs").replaceChildren(...Object.keys(TABS).map((text) => make("button", {
    role: "tab", text, "aria-selected": String(text === name), tabindex: text === name ? "0" : "-1", "aria-controls": "tabpanel", on: { click: () => showTab(text, true) }
  })));
  if (focus) { by("tabs").querySelector('[aria-selected="true"]').focus(); }
  by("tabpanel").setAttribute("aria-label", name);
  by("tabpanel").replaceChildren(...TABS[name]());
}

function say(text, level, ...more) {
  by("status").replaceChildren(make("ul", { class: "words", of: [sentence({ text, level })] }), ...more);
}

function showStatus() {
  const { states } = state.job, { look, estimate, waterfall } = states;
  const running = [estimate, waterfall, look].find((one) => one && ["waiting", "running"].includes(one.state));
  by("estimate").disabled = Boolean(running) || !state.job.files.machine || !state.look;
  by("estimate").title = state.job.files.machine ? "Estimate force and stress" : "An estimate needs the machine file";
  by("report").disabled = by("document").disabled = !(estimate && estimate.result);
  by("waterfall").disabled = !(waterfall && waterfall.result) && by("estimate").disabled;
  by("waterfall").title = "Frequencies of the coast-down, found and named; needs a record to standstill, or nearly";
  if (running) {
    const verb = Object.keys(states).find((one) => states[one] === running), share = running.fraction || 0;
    const stage = running.state === "waiting" ? "waiting for another computation" : running.stage || (verb === "look" ? "reading and checking the record" : "compiling and preparing");
    const left = share > 0.05 && share < 0.98 ? `, about ${Math.max(1, Math.round((running.spent * (1 - share)) / share))} s left in this stage` : "";
    const bar = make("progress", { max: 1, "aria-label": stage, ...(share > 0 ? { value: share } : {}) });
    say(`${{ look: "Looking", estimate: "Estimating", waterfall: "Waterfall" }[verb]}: ${stage} (${Math.round(running.spent)} s${left})`, "notice", bar,
      make("button", { text: "Cancel", id: "cancel", on: { click: async () => { state.job = await server.cancel(state.job.id, verb); await refresh(); } } }));
    return true;
  }
  const failed = [waterfall, estimate, look].find((one) => one && one.state === "failed");
  if (failed) { say(failed.error, "bad"); }
  else if (state.estimate) {
    say(state.estimate.verdict[0].text, state.estimate.verdict[0].level, ...state.estimate.cards.map(({ title, figures: [first] }) => {
      const [text, interval] = first.value[units.chosen()];
      return make("span", { class: "headline", of: [make("span", { text: `${title.split(" touchdown")[0]} ${first.label.toLowerCase()} ` }), make("strong", { text }), make("span", { class: "note", text: interval ? ` (90 %: ${interval})` : "" })] });
    }));
  }
  else if (state.look) {
    const told = state.look.verdict[0], stop = state.look.findings.find((one) => one.severity === "stop"), words = estimate && estimate.state === "cancelled" ? "The estimate was cancelled. " : "";
    say(words + (stop ? stop.message : told.text), stop ? "bad" : told.level);
  } else { say("Nothing was found yet.", "notice"); }
  return false;
}

// ---- jobs

let shown = "";
async function refresh() {
  const id = state.job.id;
  const job = await server.job(id);
  if (state.job.id !== id) { return; }
  state.job = job;
  const done = (verb) => (job.states[verb] && job.states[verb].result) || "";
  const now = `${id} ${done("look")} ${done("estimate")}`;
  if (wantsFall === id && done("waterfall")) { wantsFall = ""; await showFall(); }
  if (now !== shown) {
    const [look, estimate] = await Promise.all(["look", "estimate"].map((verb) => (done(verb) ? server.page(id, verb) : null)));
    if (state.job.id !== id) { return; }
    shown = now;
    Object.assign(state, { look, estimate, panels: [] });
    by("main").hidden = !look || !by("fall").hidden;
    if (look) {
      units.learn(look.units);
      const columns = look.places.map((place) => place.radius), [first, last] = span();
      state.view = homeView(); state.cursor = null; state.impact = -1;
      const found = await samples("look", columns, first, last, 2400);
      if (state.job.id !== id || shown !== now) { return; }
      state.overview = { time: found.time, data: { time: found.time, curves: columns.map((name) => ({ values: found[name] })) } };
      showTab(state.tab);
      await loadView();
    }
  }
  if (showStatus()) { setTimeout(() => { if (state.job && state.job.id === id) { refresh().catch(lost); } }, 400); }
}

function lost(error) {
  say(error instanceof server.Refusal ? error.message : "The server does not answer; is 'rotordrop serve' running? The page tries again.", "bad");
  if (!(error instanceof server.Refusal)) { setTimeout(() => state.job && refresh().catch(lost), 1500); }
}

async function listJobs(choose) {
  const { jobs } = await server.jobs();
  by("jobs").replaceChildren(...jobs.map((one) => make("option", { value: one.id, text: one.name })));
  by("empty").hidden = jobs.length > 0;
  by("actions").hidden = !jobs.length;
  const wantedJob = choose || localStorage.getItem("rotordrop job");
  const job = jobs.find((one) => one.id === wantedJob) || jobs[0];
  if (!job) { state.job = null; by("main").hidden = true; say("No drop yet.", "notice"); return; }
  if (state.job && state.job.id !== job.id) { leaveFall(); }
  by("jobs").value = job.id;
  localStorage.setItem("rotordrop job", job.id);
  state.job = job;
  await refresh();
}

async function chooseFiles(list) {
  const found = [...list];
  if (!found.length) { return; }
  const machine = found.find((file) => /\.toml$/i.test(file.name));
  const shaft = machine ? (await machine.text()).match(/shaft_table\s*=\s*["']([^"']+)["']/)?.[1] : null;
  const config = found.some((file) => /\.cfg$/i.test(file.name));
  const role = (file) => (file === machine ? "machine" : file.name === shaft || (config && /\.dat$/i.test(file.name)) ? "beside"
    : /tail|settled|standstill/i.test(file.name) ? "tail" : "record");
  const names = { machine: "machine file", record: "record", tail: "settled tail", beside: "named by another file", "": "leave out" };
  by("roles").replaceChildren(...found.map((file) => make("tr", { of: [make("th", { scope: "row", text: file.name }), make("td", { of: [make("select", {
    "aria-label": `What is ${file.name}`, of: Object.entries(names).map(([value, text]) => make("option", { value, text, selected: value === role(file) ? "" : null }))
  })] })] })));
  by("sending").showModal();
  by("send").focus();
  by("sending").onclose = () => {
    if (by("sending").returnValue !== "send") { return; }
    const roles = [...by("roles").querySelectorAll("select")].map((one) => one.value);
    sendFiles(found.map((file, i) => [roles[i], file]).filter(([what]) => what)).catch((error) => say(error.message, "bad"));
  };
}

by("numbers").addEventListener("toggle", async () => {
  if (!by("numbers").open || by("numberfields").children.length) { return; }
  try {
    const { properties, required } = await server.numbers();
    by("numberfields").replaceChildren(...Object.entries(properties).map(([name, { description, examples }]) => make("label", {
      of: [make("span", { text: required.includes(name) ? description : `${description} (optional)` }), make("input", { name, placeholder: examples[0], maxlength: 120, autocomplete: "off" })]
    })));
    by("numberfields").querySelector("input").focus();
  } catch (error) { say(error.message, "bad"); }
});
const numbersGiven = () => Object.fromEntries([...by("numberfields").querySelectorAll("input")].map((one) => [one.name, one.value.trim()]).filter(([, value]) => value));

async function sendFiles(pairs) {
  const records = pairs.filter(([what]) => what === "record"), others = pairs.filter(([what]) => what !== "record");
  if (!records.length) { say("None of these files is a record.", "bad"); return; }
  let last = null;
  for (const [, record] of records) {
    const job = await server.newJob(record.name.replace(/\.[^.]+$/, ""), { gap: by("gap").value, speed: by("speed").value });
    try {
      for (const [what, file] of [...others, ["record", record]]) {
        say(`Sending ${file.name} …`, "notice");
        await server.send(job.id, what, file);
      }
      const numbers = numbersGiven();
      if (Object.keys(numbers).length && !others.some(([what]) => what === "machine")) { await server.sendNumbers(job.id, numbers); }
      await server.begin(job.id, "look");
    } catch (error) { await server.remove(job.id); throw error; }
    last = job.id;
  }
  await listJobs(last);
}

// ---- wiring

const click = (id, handler) => by(id).addEventListener("click", () => Promise.resolve(handler()).catch((error) => say(error.message, "bad")));
const openFiles = () => by("files").click();
click("open", openFiles); click("open2", openFiles); click("help", () => by("keys").showModal());
by("files").addEventListener("change", () => { chooseFiles(by("files").files); by("files").value = ""; });
by("jobs").addEventListener("change", () => listJobs(by("jobs").value).catch(lost));
click("estimate", async () => { state.job = await server.begin(state.job.id, "estimate", { method: by("method").value }); await refresh(); });
async function openReport(verb) {
  const opened = window.open("about:blank");
  const address = await server.reportAddress(state.job.id, verb);
  if (opened) { opened.opener = null; opened.location = address; } else { location.assign(address); }
}
click("report", () => openReport("estimate"));
let wantsFall = "";
async function showFall() {
  const { id } = state.job, page = await server.page(id, "waterfall");
  if (state.job.id !== id) { return; }
  play(false);
  by("main").hidden = true;
  by("fall").hidden = false;
  await openFall(id, page);
  by("fallmap").focus();
}
function leaveFall() {
  if (by("fall").hidden) { return; }
  by("fall").hidden = true;
  by("main").hidden = !state.look;
  if (state.panels.length) { drawAll(); }
  by("waterfall").focus();
}
async function waterfall() {
  const told = state.job.states.waterfall;
  if (told && told.result) { await showFall(); return; }
  wantsFall = state.job.id;
  state.job = await server.begin(state.job.id, "waterfall", {});
  await refresh();
}
click("waterfall", waterfall);
click("fallback", leaveFall);
click("fallreport", () => openReport("waterfall"));
by("fallfiles").replaceChildren(files("Waterfall", { csv: fallFiles.CSV, svg: fallFiles.SVG, png: fallFiles.PNG, python: () => { by("code").textContent = fallFiles.Python(); by("lines").showModal(); } }));
click("document", async () => keep(new Blob([await server.documentText(state.job.id, "estimate")], { type: "application/json" }), `${state.job.name}.json`));
click("remove", () => by("sure").showModal());
by("sure").addEventListener("close", async () => {
  if (by("sure").returnValue === "remove") { await server.remove(state.job.id); shown = ""; await listJobs().catch(lost); }
});
click("whole", () => setWindow(...span())); click("early", () => setView(homeView()));
click("next", () => goImpact(nextImpact(1))); click("previous", () => goImpact(nextImpact(-1)));
click("play", () => play(state.playing === null));
const nextImpact = (direction) => {
  if (state.impact >= 0) { return state.impact + direction; }
  const list = impacts(), at = state.cursor ?? state.view.from;
  return direction > 0 ? Math.max(0, list.findIndex((one) => one.time > at)) : list.findLastIndex((one) => one.time < at);
};
for (const id of ["from", "to"]) {
  by(id).addEventListener("change", () => {
    const [scale] = units.timeScale(state.view.to - state.view.from), [from, to] = ["from", "to"].map((name) => scale * Number(by(name).value.replace(",", ".").replace("−", "-")));
    if (Number.isFinite(from) && to > from) { setWindow(from, to); }
  });
}
by("signal").addEventListener("change", () => state.view && loadView());
function chooseUnits(name) { units.choose(name); by("units").value = name; if (state.look && state.view) { showTab(state.tab); showStatus(); redraw(); } }
by("units").addEventListener("change", () => chooseUnits(by("units").value));
const dark = matchMedia("(prefers-color-scheme: dark)");
function chooseTheme(name) {
  localStorage.setItem("rotordrop theme", name);
  by("theme").value = name;
  document.documentElement.dataset.theme = name || (dark.matches ? "dark" : "light");
  redraw();
}
by("theme").addEventListener("change", () => chooseTheme(by("theme").value));
dark.addEventListener("change", () => chooseTheme(by("theme").value));

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

const KEYS = {
  n: () => goImpact(nextImpact(1)), p: () => goImpact(nextImpact(-1)), " ": () => play(state.playing === null),
  "+": () => zoom(0.6), "=": () => zoom(0.6), "-": () => zoom(1.7), 0: () => setWindow(...span()), d: () => setView(homeView()),
  u: () => chooseUnits(units.chosen() === "SI" ? "US" : "SI"), t: () => chooseTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"),
  ArrowLeft: (event) => (event.shiftKey ? pan(-1) : stepCursor(-1)), ArrowRight: (event) => (event.shiftKey ? pan(1) : stepCursor(1))
};
for (const signal of ["y", "x", "r"]) { KEYS[signal] = () => { by("signal").value = signal; loadView(); }; }
const pan = (direction) => { const by4 = ((state.view.to - state.view.from) / 4) * direction; setView({ from: state.view.from + by4, to: state.view.to + by4 }); };
document.addEventListener("keydown", (event) => {
  const typing = event.target.closest("input, select, textarea, dialog");
  if (event.target.closest("[role=tablist]") && /^Arrow(Left|Right)$/.test(event.key)) {
    const names = Object.keys(TABS), step = event.key === "ArrowRight" ? 1 : names.length - 1;
    showTab(names[(names.indexOf(state.tab) + step) % names.length], true);
    return;
  }
  if (typing || event.ctrlKey || event.metaKey || event.altKey || (event.key === " " && event.target.closest("button"))) { return; }
  if (event.key === "?") { by("keys").showModal(); return; }
  if (event.key === "o") { openFiles(); return; }
  if (event.key === "w" && !by("waterfall").disabled && !by("actions").hidden) { (by("fall").hidden ? waterfall : leaveFall)(); return; }
  if (event.key === "Escape") { leaveFall(); return; }
  if (!by("fall").hidden && !"ut".includes(event.key)) { return; }
  if (state.look && state.view && KEYS[event.key]) { event.preventDefault(); KEYS[event.key](event); }
});
document.addEventListener("dragover", (event) => { event.preventDefault(); document.body.classList.add("over"); });
document.addEventListener("dragleave", (event) => { if (!event.relatedTarget) { document.body.classList.remove("over"); } });
document.addEventListener("drop", (event) => { event.preventDefault(); document.body.classList.remove("over"); chooseFiles(event.dataTransfer.files); });
const redraw = () => { if (!by("fall").hidden) { drawFall(); } else if (state.panels.length) { drawAll(); } };
let waiting = 0;
window.addEventListener("resize", () => { clearTimeout(waiting); waiting = setTimeout(redraw, 120); });

by("units").value = units.chosen();
chooseTheme(localStorage.getItem("rotordrop theme") || "");
listJobs().catch(lost);
