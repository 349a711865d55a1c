// Comparison with other drops: their traces on the axes of this one, and the numbers of all with their intervals.
import { canvasPen, colours, keep, keepPng, keepSvg, placeColour, svgPen, ticks } from "./figures.js";
import { loadView } from "./panels.js";
import * as server from "./server.js";
import { by, fileName, files, say, showLines, state, usesEstimate } from "./state.js";
import { make } from "./tables.js";
import * as units from "./units.js";

const DASHES = [[7, 4], [2, 3], [10, 3, 2, 3]], MOST = DASHES.length;
const MARKS = ["●", "□", "△", "◇"];
export const dashOf = (k) => DASHES[k % MOST];
const keyOf = (drop) => drop.job || `log ${drop.log}`;

// What the other drops have for a figure of this one: the same quantity at the place of the same name.
export function othersOf(kind, index, name) {
  return state.others.filter((other) => other.look || other.estimate).flatMap((other) => {
    const verb = kind === "motion" && !(usesEstimate() && other.estimate) ? "look" : "estimate", page = other[verb];
    const place = page && (page.places.find((one) => one.name === name) || page.places[index]);
    const columns = place && (kind === "motion" ? place.measured || place.estimated : place[kind].slice(0, 1));
    const origin = verb === "look" ? (other.estimate || other.look).zero : 0;
    return columns ? [{ other, verb, origin, columns, place: index, k: state.others.indexOf(other), label: kind === "motion" ? other.name : `${other.name}, ${place.name}` }] : [];
  });
}

export const curvesOfOthers = (panel, from, to) => Promise.all(panel.others.map(async (one) => {
  const { verb, origin, columns, other } = one, { start, end } = other[verb].traces;
  if (to + origin <= start || from + origin >= end) { return { ...one, found: { time: new Float64Array(0), ...Object.fromEntries(columns.map((name) => [name, []])) } }; }
  const found = await server.samples(other.job, verb, columns, from + origin, to + origin);
  found.time = found.time.map((t) => t - origin);
  return { ...one, found };
}));

async function opened(drop) {
  const job = drop.job && await server.job(drop.job);
  const [look, estimate] = await Promise.all(["look", "estimate"].map((verb) => (job?.states[verb]?.result ? server.page(job.id, verb) : null)));
  return { ...drop, look, estimate };
}

export async function chooseOthers() {
  const { drops, problem } = await everyDrop();
  const found = drops.filter((drop) => drop.job !== state.job.id), now = state.others.map(keyOf);
  const told = (drop) => [drop.machine, drop.speed && drop.speed[units.chosen()][0], drop.recorded, drop.log ? `log ${drop.log}, numbers only` : drop.numbers.length ? "estimate" : "looked at only"].filter(Boolean).join(" · ");
  by("dropsfound").replaceChildren(...(problem ? [make("p", { class: "small", text: problem })] : []), ...(found.length ? found.map((drop, i) => make("label", { class: "choice", of: [
    make("input", { type: "checkbox", value: i, ...(now.includes(keyOf(drop)) ? { checked: "" } : {}) }), make("span", { text: drop.name }), make("span", { class: "small", text: told(drop) })] }))
    : [make("p", { text: "There is no other drop yet, neither on this page nor in the log." })]));
  const boxes = [...by("dropsfound").querySelectorAll("input")];
  const limit = () => { const many = boxes.filter((box) => box.checked).length >= MOST; boxes.forEach((box) => { box.disabled = many && !box.checked; }); };
  boxes.forEach((box) => box.addEventListener("change", limit));
  limit();
  by("compare").showModal();
  by("compare").onclose = () => {
    if (by("compare").returnValue === "choose") { setOthers(boxes.filter((box) => box.checked).map((box) => found[box.value])).catch((error) => say(error.message, "bad")); }
  };
}

export async function setOthers(drops) {
  const { id } = state.job, found = await Promise.all(drops.map(opened));
  if (state.job.id !== id) { return; }
  state.others = found;
  document.dispatchEvent(new Event("compared"));
  if (state.view) { await loadView(); }
}

// ---- numbers of all drops, on one axis for every quantity

const rows = () => {
  const own = state.drops.find((drop) => drop.job === state.job.id);
  return [...(own ? [own] : []), ...state.others.filter((other) => other.numbers.length)];
};
function groups() {
  const found = new Map();
  for (const [k, drop] of rows().entries()) {
    for (const one of drop.numbers) {
      const title = `${one.bearing}: ${one.quantity}`;
      found.set(title, [...(found.get(title) || []), { ...one, drop, k }]);
    }
  }
  return [...found];
}

function drawNumbers(pen) {
  const tone = colours(), list = groups(), left = 12, right = pen.width - 14;
  let y = 4;
  for (const [title, entries] of list) {
    const f = units.factor(entries[0].kind), high = 1.06 * Math.max(...entries.map((one) => one.upper / f)), box = { left: left + 8, right };
    const px = (v) => box.left + (v / high) * (box.right - box.left), top = y + 18, bottom = top + 24 * entries.length;
    pen.text(`${title} [${units.unit(entries[0].kind)}], 90 % intervals`, left, y + 12, tone.ink, { size: 12, weight: "600" });
    for (const v of ticks(0, high, 6)) {
      pen.line([[px(v), top], [px(v), bottom]], tone.line);
      pen.text(String(v), px(v), bottom + 13, tone.ink, { align: "center", size: 10 });
    }
    entries.forEach(({ lower, upper, value, drop, k }, i) => {
      const at = top + 24 * i + 16, colour = k ? placeColour(tone, k) : tone.ink;
      pen.text(drop.name, box.left + 2, at - 5, tone.muted, { size: 10.5 });
      pen.line([[px(lower / f), at], [px(upper / f), at]], colour, 2, k ? dashOf(k - 1) : []);
      for (const edge of [lower, upper]) { pen.line([[px(edge / f), at - 4], [px(edge / f), at + 4]], colour, 1.5); }
      if (value !== null) { pen.text(MARKS[k], px(value / f), at + 4.5, colour, { align: "center", size: 13 }); }
    });
    y = bottom + 20;
  }
  return y;
}
const heightOf = () => groups().reduce((sum, [, entries]) => sum + 38 + 24 * entries.length, 8);
const numbersPicture = () => {
  const pen = svgPen(720, heightOf(), colours().back, "Drops compared");
  drawNumbers(pen);
  return pen;
};
const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
const csvOf = () => [`drop,bearing,quantity,${units.COLUMNS}`, ...groups().flatMap(([, entries]) => entries.map((one) =>
  [one.drop.name, one.bearing, one.quantity, ...units.columnsOf(one)].map(String).map(quoted).join(","))), ""].join("\n");
const pythonOf = () => [state.estimate?.python.peaks, ...state.others.map((other) => `# ${other.name}\n${other.python && typeof other.python === "string" ? other.python : other.estimate?.python.peaks || ""}`)].filter(Boolean).join("\n");

export function compareTab() {
  const canvas = make("canvas", { class: "numbers-of", role: "img", "aria-label": groups().map(([title, entries]) => `${title}: ${entries.map((one) => `${one.drop.name} ${one[units.chosen()].filter(Boolean).join(", ")}`).join("; ")}`).join(". ") });
  canvas.height = heightOf();
  const chosen = state.others.map((other, k) => make("li", { of: [make("span", { text: `${MARKS[k + 1]} ${["dashed", "dotted", "dash-dotted"][k]}` }), make("span", { text: other.name })] }));
  const made = groups().length ? [make("figure", { of: [canvas, make("header", { class: "right", of: [files("Drops compared", {
    csv: () => keep(new Blob([csvOf()], { type: "text/csv" }), `${fileName("compared")}.csv`), svg: () => keepSvg(numbersPicture(), fileName("compared")),
    png: () => keepPng(numbersPicture(), fileName("compared")), python: () => showLines(pythonOf())
  })] })] }),
  make("div", { class: "table", of: [make("table", { of: [make("thead", { of: [make("tr", { of: ["drop", "quantity", "value"].map((text, i) => make("th", { scope: "col", text, class: i > 1 ? "number" : null })) })] }),
    make("tbody", { of: groups().flatMap(([title, entries]) => entries.map((one) => make("tr", { of: [make("th", { scope: "row", text: one.drop.name }), make("td", { text: title }),
      make("td", { class: "number", of: [make("span", { class: "value", text: one[units.chosen()][0] }), make("span", { class: "interval", text: one[units.chosen()][1] })] })] }))) })] })] })] : [];
  requestAnimationFrame(() => { if (canvas.isConnected) { canvas.style.height = `${heightOf()}px`; drawNumbers(canvasPen(canvas)); } });
  return [make("p", { class: "small", text: state.others.length ? "Drawn in the figures beside this drop, told apart by the kind of line:" : "Other drops of this page, or of a log, on the axes of this one." }),
    make("ul", { class: "others", of: chosen }), make("button", { text: "Choose drops …", id: "choosedrops", on: { click: () => chooseOthers().catch((error) => say(error.message, "bad")) } }), ...made];
}

// The drops of the page, and those of the log that are not among them.
async function everyDrop(wanted = []) {
  const [{ jobs }, log] = await Promise.all([server.jobs(), server.log()]), here = new Set(jobs.map((one) => one.row?.sha256));
  const kept = jobs.filter((one) => one.row && (!one.label?.archived || wanted.includes(one.id))).map((one) => ({ ...one.row, job: one.id, name: one.name }));
  state.drops = [...kept, ...log.drops.filter((one) => !here.has(one.sha256))];
  return { drops: state.drops, problem: log.problem };
}
export async function learnDrops(wanted = []) {
  const { drops } = await everyDrop(wanted), others = drops.filter((drop) => wanted.includes(drop.job));
  if (others.length) { await setOthers(others.slice(0, MOST)); }
}
