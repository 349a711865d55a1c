// What the parts of the page share: one job, one window, one cursor.
import * as server from "./server.js";
import { make, sentence } from "./tables.js";

export const by = (id) => document.getElementById(id);
export const state = { job: null, look: null, estimate: null, view: null, cursor: null, impact: -1, tab: "Impacts", panels: [], overview: null, playing: null, serial: 0,
  speed: null, others: [], drops: [] };
export const zero = () => (state.estimate || state.look).zero;
export const simulated = () => (state.estimate || state.look)?.simulated || "";
export const shift = (verb) => state[verb].zero - zero();
export const span = () => { const { start, end } = state.look.traces; return [start - state.look.zero + shift("look"), end - state.look.zero + shift("look")]; };
export const homeView = () => (state.estimate ? { from: -0.005, to: state.estimate.traces.end }
  : { from: -0.02, to: Math.min(0.4, span()[1]) });
export const usesEstimate = () => state.estimate && state.view.from >= -0.05 && state.view.to <= state.estimate.traces.end + 0.01;
export const impacts = () => (state.estimate && state.estimate.impacts.length ? state.estimate.impacts
  : state.look.impacts.map((one) => ({ ...one, time: one.time - zero() })));

// What happened when, times from power-off. Of the first look only what an estimate does not know better.
export const events = () => {
  const looked = state.look.timeline.map(({ time, words }) => ({ time: time - zero(), words }));
  if (!state.estimate?.timeline) { return looked; }
  const { end } = state.estimate.traces;
  return [...state.estimate.timeline, ...looked.filter(({ time, words }) => words.startsWith("record ") || time > end)].sort((a, b) => a.time - b.time);
};

// Samples over a window that counts from power-off.
export async function samples(verb, columns, from, to, points) {
  const own = verb === "look" ? zero() : shift("estimate");
  const found = await server.samples(state.job.id, verb, columns, from + own, to + own, points);
  found.time = found.time.map((t) => t - own);
  return found;
}

export function say(text, level, ...more) {
  by("status").replaceChildren(make("ul", { class: "words", of: [sentence({ text, level })] }), ...more);
}

export function showLines(text) {
  by("code").textContent = text;
  by("lines").showModal();
}

export const files = (title, ways) => make("span", { class: "files", of: Object.entries({ CSV: ways.csv, SVG: ways.svg, PNG: ways.png, Python: ways.python })
  .map(([text, click]) => make("button", { text, "aria-label": `${title}: ${text === "Python" ? "as Python" : `save as ${text}`}`,
    on: { click: () => Promise.resolve(click()).catch((error) => say(error.message, "bad")) } })) });
export const fileName = (title) => `${state.job.name} ${title}${simulated() ? " simulated" : ""}`.replace(/[^\w.-]+/g, "_");
