// Tables and sentences. Every text goes in as text: names from files are never markup.
import { chosen } from "./units.js";

export function make(name, { text, of = [], on = {}, ...attributes } = {}) {
  const element = document.createElement(name);
  if (text !== undefined) { element.textContent = text; }
  Object.entries(attributes).forEach(([key, value]) => { if (value !== null) { element.setAttribute(key, value); } });
  Object.entries(on).forEach(([event, handler]) => element.addEventListener(event, handler));
  element.append(...of);
  return element;
}

export const BADGES = { good: "good", notice: "note", warning: "warning", bad: "problem" };

export const sentence = ({ text, level }) => make("li", {
  class: level, of: [make("span", { class: "badge", text: BADGES[level] || level }), make("span", { text })]
});

// No line breaks between a number and its unit.
export const quantity = (cell) => {
  const [text, interval] = cell[chosen()].map((one) => one && one.replace(/(\d) (?=[^\d\s(]+( \(|$))/g, "$1\u00a0"));
  return [make("span", { class: "value", text }), ...(interval ? [make("span", { class: "interval", text: interval })] : [])];
};

export function impactTable(impacts, columns, here, timeOf, go) {
  const marked = impacts.some((one) => "impact" in one);
  const head = make("tr", { of: ["place", "time", ...columns.map((column) => column[chosen()]), ...(marked ? ["impact"] : [])].map((text, i) => make("th", { scope: "col", text, class: i && i < columns.length + 2 ? "number" : null })) });
  const rows = impacts.map((impact, i) => make("tr", {
    class: i === here ? "here" : null, "aria-current": i === here ? "true" : null, on: { click: () => go(i) },
    of: [make("th", { scope: "row", of: [make("button", { class: "link", text: impact.place, "aria-label": `Go to impact ${i + 1} at ${impact.place}`, on: { click: (event) => { event.stopPropagation(); go(i); } } })] }),
      make("td", { class: "number", text: timeOf(impact.time) }),
      ...impact.numbers.map((cell) => make("td", { class: "number", of: quantity(cell) })), ...(marked ? [make("td", { text: impact.impact ? "yes" : "" })] : [])]
  }));
  return make("table", { class: "impacts", of: [make("thead", { of: [head] }), make("tbody", { of: rows })] });
}

export function timeline(events, timeOf, go) {
  return make("ol", { class: "timeline", of: events.map(({ time, words }) => make("li", {
    of: [make("button", { class: "link", text: timeOf(time), on: { click: () => go(time) } }), make("span", { text: words })]
  })) });
}
