// What the parts of the page share: one job, one window, one cursor.
import { menu } from "./menu.js";
import * as server from "./server.js";
import { make, sentence } from "./tables.js";

export const by = (id) => document.getElementById(id);
export const state = { job: null, look: null, estimate: null, view: null, cursor: null, impact: -1, tab: "Impacts", panels: [], loaded: [], orbits: [], overview: null, playing: null, serial: 0,
  speed: null, others: [], drops: [], mark: null, between: null, figures: null, own: [] };
export const zero = () => (state.estimate || state.look).zero;
// What times count from: an estimate knows power-off, a look only the release.
export const origin = () => (state.estimate ? "power-off" : state.look.counted_from || "the release (± 2 ms)");
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

// What is said of instants, times from power-off.
export const notes = () => state.job?.label?.notes || [];
// Vertical lines of every figure over time: the mark of the second cursor, and notes.
export const uprights = () => [...(state.mark === null ? [] : [{ time: state.mark, text: "mark", mark: true }]), ...notes()];

export function say(text, level, ...more) {
  by("status").replaceChildren(make("ul", { class: "words", of: [sentence({ text, level })] }), ...more);
}

// What goes wrong in an action is said on the page.
export const tried = (promise) => Promise.resolve(promise).catch((error) => say(error.message, "bad"));

export function showLines(text, title = "As Python") {
  by("linestitle").textContent = title;
  by("code").textContent = text;
  by("lines").showModal();
}

const WAYS = { csv: "Save as CSV", svg: "Save as SVG", png: "Save as PNG", python: "As Python", command: "As command" };
// The one menu of a figure: what can be saved of it, and how it is made again.
export const files = (title, ways) => menu("⋯", `${title}: save, as Python`, Object.entries(WAYS).filter(([way]) => ways[way]).map(([way, text]) => [text, () => Promise.resolve(ways[way]()).catch((error) => say(error.message, "bad")), { "aria-label": `${title}: ${text[0].toLowerCase()}${text.slice(1)}` }]), { class: "menu files" });
export const fileName = (title) => `${state.job.name} ${title}${simulated() ? " simulated" : ""}`.replace(/[^\w.-]+/g, "_");
