// What the parts of the page share: one job, one window, one cursor.
import * as server from "./server.js";
import { make, sentence } from "./tables.js";

export const by = (id) => document.getElementById(id);
export const state = { job: null, look: null, estimate: null, view: null, cursor: null, mark: null, impact: -1, tab: "Impacts", report: "", together: [],
  panels: [], orbits: [], overview: null, playing: null, serial: 0, speed: null };
export const zero = () => (state.estimate || state.look).zero;
// What times count from: an estimate knows power-off, a look only the release.
export const origin = () => (state.estimate ? "power-off" : state.look.counted_from || "the release");
export const simulated = () => (state.estimate || state.look)?.simulated || "";
export const shift = (verb) => state[verb].zero - zero();
export const span = () => { const { start, end } = state.look.traces; return [start - state.look.zero + shift("look"), end - state.look.zero + shift("look")]; };
export const homeView = () => (state.estimate ? { from: -0.005, to: state.estimate.traces.end }
  : { from: -0.02, to: Math.min(0.4, span()[1]) });
export const usesEstimate = () => state.estimate && state.view.from >= -0.05 && state.view.to <= state.estimate.traces.end + 0.01;
export const impacts = () => (state.estimate && state.estimate.impacts.length ? state.estimate.impacts
  : state.look.impacts.map((one) => ({ ...one, time: one.time - zero() })));
export const hits = () => impacts().filter((one) => one.impact !== false);
// What an estimate says of a place that is drawn; an estimate has one for every bearing, a look for every sensor plane.
export const estimated = (name) => state.estimate?.places.find((place) => place.name === name);

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
// What the server says against something, or that it does not answer; whether it is worth to ask again.
export function refused(error) {
  const answered = error instanceof server.Refusal;
  say(answered ? error.message : "The server does not answer; is 'rotordrop serve' running? The page tries again.", "bad");
  return !answered;
}
// What goes wrong in an action is said on the page.
export const tried = (promise) => Promise.resolve(promise).catch((error) => say(error.message, "bad"));
export const fileName = (title) => `${state.job.name} ${title}${simulated() ? " simulated" : ""}`.replace(/[^\w.-]+/g, "_");
