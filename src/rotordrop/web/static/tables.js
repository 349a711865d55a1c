// Tables and sentences. Every text goes in as text: names from files are never markup.
import { chosen, inWords } from "./units.js";

export function make(name, { text, of = [], on = {}, ...attributes } = {}) {
  const element = document.createElement(name);
  if (text !== undefined) { element.textContent = text; }
  Object.entries(attributes).forEach(([key, value]) => { if (value !== null) { element.setAttribute(key, value); } });
  Object.entries(on).forEach(([event, handler]) => element.addEventListener(event, handler));
  element.append(...of);
  return element;
}

export const BADGES = { good: "good", notice: "note", warning: "warning", bad: "problem", stop: "problem", note: "note" };

export const sentence = ({ text, level }) => make("li", {
  class: level, of: [make("span", { class: "badge", text: BADGES[level] || level }), make("span", { text: inWords(text) })]
});

// No line breaks between a number and its unit.
const number = (cell) => {
  const [text, interval] = cell[chosen()].map((one) => one && one.replace(/(\d) (?=[^\d\s(]+( \(|$))/g, "$1\u00a0"));
  return [make("span", { class: "value", text }), ...(interval ? [make("span", { class: "interval", text: interval })] : [])];
};
const LEVEL = "Small beside a value: its 90 % interval.";
export const levelOf = (rows) => (rows.some((row) => row.some((cell) => typeof cell !== "string" && cell[chosen()][1])) ? [make("p", { class: "small", text: LEVEL })] : []);

const cellOf = (cell, first) => (typeof cell === "string"
  ? make(first ? "th" : "td", first ? { scope: "row", text: cell } : { text: cell })
  : make("td", { class: "number", of: number(cell) }));

const headOf = (column) => (typeof column === "string" ? column : column[chosen()]);

export function table({ caption, note, columns, rows }) {
  const head = make("tr", { of: columns.map((column, i) => make("th", { scope: "col", text: headOf(column), class: rows[0] && typeof rows[0][i] !== "string" ? "number" : null })) });
  const body = rows.map((row) => make("tr", { of: row.map((cell, i) => cellOf(cell, i === 0)) }));
  const parts = [...(caption ? [make("caption", { text: caption })] : []), make("thead", { of: [head] }), make("tbody", { of: body })];
  return make("div", { class: "table", of: [make("table", { of: parts }), ...levelOf(rows), ...(note ? [make("p", { class: "small", text: note })] : [])] });
}

export function cards(list) {
  return make("div", { of: [make("div", { class: "cards", of: list.map(({ title, figures }) => make("article", {
    class: "card", of: [make("h3", { text: title }), make("dl", { of: figures.map(({ label, value, note }) => make("div", {
      of: [make("dt", { text: label }), make("dd", { of: [...number(value), ...(note ? [make("span", { class: "note", text: note })] : [])] })]
    })) })]
  })) }), ...levelOf(list.map(({ figures }) => figures.map(({ value }) => value)))] });
}

export function impactTable(impacts, columns, here, timeOf, go) {
  const head = make("tr", { of: ["place", "time", ...columns.map(headOf)].map((text, i) => make("th", { scope: "col", text, class: i ? "number" : null })) });
  const rows = impacts.map((impact, i) => make("tr", {
    class: i === here ? "here" : null, "aria-current": i === here ? "true" : null, on: { click: () => go(i) },
    of: [make("th", { scope: "row", of: [make("button", { class: "link", text: impact.place, "aria-label": `Go to impact ${i + 1} at ${impact.place}`, on: { click: (event) => { event.stopPropagation(); go(i); } } })] }),
      make("td", { class: "number", text: timeOf(impact.time) }),
      ...impact.numbers.map((cell) => make("td", { class: "number", of: number(cell) }))]
  }));
  return make("table", { class: "impacts", of: [make("thead", { of: [head] }), make("tbody", { of: rows })] });
}

export function timeline(events, timeOf, go) {
  return make("ol", { class: "timeline", of: events.map(({ time, words }) => make("li", {
    of: [make("button", { class: "link", text: timeOf(time), on: { click: () => go(time) } }), make("span", { text: words })]
  })) });
}

export const facts = (list) => make("dl", { class: "facts", of: list.map(([name, value]) => make("div", { of: [make("dt", { text: name }), make("dd", { text: value })] })) });

export function findings(list) {
  if (!list.length) { return make("ul", { class: "statements", of: [sentence({ text: "The plausibility checks found nothing wrong with the record.", level: "good" })] }); }
  return make("ul", { class: "statements", of: list.map((found) => sentence({ level: { stop: "bad", warning: "warning", note: "notice" }[found.severity], text: `${found.channel ? `${found.channel}: ` : ""}${found.message}. ${found.remedy}` })) });
}
