// The log: force and stress from drop to drop of one set of bearings, with limits and what is allowed.
import * as address from "./address.js";
import { canvasPen, colours, faint, keep, keepPng, keepSvg, placeColour, svgPen, ticks } from "./figures.js";
import { numberCell, worst } from "./home.js";
import * as server from "./server.js";
import { by, files, say, showLines } from "./state.js";
import { make, sentence } from "./tables.js";
import * as units from "./units.js";

const MARKS = ["●", "□", "△", "◇"], MOST_NAMED = 24, MOST_SAID = 5;
const FIGURES = [["peak_force_N", "force", "Peak bearing force"], ["peak_stress_Pa", "pressure", "Peak Hertz stress"]];
const view = { log: null, jobs: [], machine: "", bearings: "", limits: {} };
const keyOf = (one) => JSON.stringify([one.machine, one.bearings]);
const here = () => view.log.drops.filter((one) => one.machine === view.machine && one.bearings === view.bearings);
const allowed = () => view.log.used.find((one) => one.machine === view.machine && one.bearings === view.bearings)?.allowed;

// One figure: every drop in its order, a mark and an interval for every bearing, limits as lines.
function trend(pen, [field, kind, title], left, right, top, bottom) {
  const beneath = right - left < 560 ? 15 : 0, tone = colours(), drops = here(), f = units.factor(kind), box = { left: left + 64, right: right - 14, top: top + 26 + beneath, bottom: bottom - 46 };
  const bearings = [...new Set(drops.flatMap((drop) => drop.numbers.map((one) => one.bearing)))], limit = view.limits[kind], most = allowed();
  const ends = drops.flatMap((drop) => drop.numbers.filter((one) => one.field === field).map((one) => one.upper / f));
  const high = 1.1 * Math.max(...ends, limit ? limit / f : 0, 0) || 1, slots = Math.max(drops.length, most || 0, 4);
  const px = (slot) => box.left + ((slot + 0.5) / slots) * (box.right - box.left), py = (v) => box.bottom - (v / high) * (box.bottom - box.top);
  pen.text(`${title} [${units.unit(kind)}], 90 % intervals`, box.left, top + 13, tone.ink, { size: 12.5, weight: "600" });
  bearings.forEach((name, k) => pen.text(`${MARKS[k % 4]} ${name}`, box.right - 60 * (bearings.length - 1 - k), top + 13 + beneath, placeColour(tone, k), { align: "right", size: 12 }));
  for (const v of ticks(0, high, 5)) {
    pen.line([[box.left, py(v)], [box.right, py(v)]], tone.line);
    pen.text(String(v), box.left - 6, py(v) + 4, tone.ink, { align: "right" });
  }
  if (limit) {
    pen.line([[box.left, py(limit / f)], [box.right, py(limit / f)]], tone.limit, 1.4, [6, 4]);
    pen.text(`limit ${units.shown(limit, kind)}`, box.right - 4, py(limit / f) - 4, tone.limit, { align: "right", size: 10.5 });
  }
  if (most) {
    const edge = px(most - 0.5);
    pen.line([[edge, box.top], [edge, box.bottom]], tone.limit, 1.4, [2, 3]);
    if (most < slots) { pen.area([[edge, box.top], [box.right, box.top], [box.right, box.bottom], [edge, box.bottom]], faint(tone.limit, 0.1)); }
    pen.text(`${most} drops allowed`, edge - 4, box.top + 10, tone.limit, { align: "right", size: 10.5 });
  }
  const each = Math.ceil(slots / MOST_NAMED);
  drops.forEach((drop, slot) => {
    if (slot % each === 0) { pen.text(String(drop.log), px(slot), box.bottom + 14, tone.ink, { align: "center", size: 10.5 }); }
    if (slots <= 12) { pen.text((drop.recorded || drop.added).slice(0, 10), px(slot), box.bottom + 26, tone.muted, { align: "center", size: 9.5 }); }
    drop.numbers.filter((one) => one.field === field).forEach(({ bearing, value, lower, upper }) => {
      const k = bearings.indexOf(bearing), x = px(slot) + 7 * (k - (bearings.length - 1) / 2), colour = placeColour(tone, k);
      pen.line([[x, py(lower / f)], [x, py(upper / f)]], colour, 2);
      for (const edge of [lower, upper]) { pen.line([[x - 3, py(edge / f)], [x + 3, py(edge / f)]], colour, 1.4); }
      if (value !== null) { pen.text(MARKS[k % 4], x, py(value / f) + 4, colour, { align: "center", size: 12 }); }
    });
  });
  pen.line([[box.left, box.bottom], [box.right, box.bottom]], tone.muted);
  pen.text("drop of the log, in the order they happened", (box.left + box.right) / 2, bottom - 4, tone.ink, { align: "center" });
}
// Side by side where there is room, else one above the other.
const drawTrends = (pen) => FIGURES.forEach((one, i) => (pen.width > 1400 ? trend(pen, one, (i * pen.width) / 2, ((i + 1) * pen.width) / 2, 0, pen.height) : trend(pen, one, 0, pen.width, (i * pen.height) / 2, ((i + 1) * pen.height) / 2)));
const picture = () => { const pen = svgPen(1000, 620, colours().back, `${view.machine}, bearings ${view.bearings}`); drawTrends(pen); return pen; };
const name = () => `log ${view.machine} ${view.bearings}`.replace(/[^\w.-]+/g, "_");
const csv = () => [`drop,date,bearing,quantity,${units.COLUMNS}`, ...here().flatMap((drop) => drop.numbers.map((one) =>
  [drop.log, drop.recorded || drop.added, one.bearing, one.quantity, ...units.columnsOf(one)].map((cell) => JSON.stringify(cell)).join(","))), ""].join("\n");
const python = () => `from rotordrop.ledger.book import logged_drops, trends\n\ndrops = logged_drops(${JSON.stringify(view.log.name)}, machine=${JSON.stringify(view.machine)}, bearing_set=${JSON.stringify(view.bearings)})\nrising = trends(${JSON.stringify(view.log.name)}, machine=${JSON.stringify(view.machine)})\n`;
const quoted = (text) => (/^[\w.-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);
const command = () => ['show', `allow --bearings ${quoted(view.bearings)} --drops N --source TEXT`].map((what) => what.replace(/^\w+/, (verb) => `rotordrop log ${verb} ${quoted(view.log.name)} --machine ${quoted(view.machine)}`)).join("\n");

// Which drops pass a limit: surely where the whole interval lies beyond it, else perhaps.
function passed([field, kind, title]) {
  const limit = view.limits[kind], f = units.factor(kind), name = `the limit of ${units.shown(limit, kind)} on the ${title.replace(/^P/, "p")}`;
  const beyond = here().flatMap((drop) => drop.numbers.filter((one) => limit && one.field === field && one.upper > limit).map((one) => ({ ...one, drop: drop.log })));
  return [true, false].flatMap((sure) => {
    const some = beyond.filter(({ lower }) => (lower > limit) === sure), last = some.slice(-MOST_SAID);
    const list = last.map(({ drop, bearing, lower, upper }) => `drop ${drop} at ${bearing} by ${sure ? `${units.written((lower - limit) / f, 3)} to ` : "up to "}${units.shown(upper - limit, kind, 3)}`);
    return some.length ? [{ text: `${sure ? "Passed" : "Perhaps passed"} is ${name}: ${list.join("; ")}${some.length > last.length ? `; and by ${some.length - last.length} before them` : ""} (90 % intervals).`, level: sure ? "bad" : "warning" }] : [];
  });
}

function limitField(kind, text) {
  const input = make("input", { inputmode: "decimal", size: 7, "aria-label": `Limit of ${text} [${units.unit(kind)}]`, value: view.limits[kind] ? Number((view.limits[kind] / units.factor(kind)).toPrecision(6)) : "" });
  input.addEventListener("change", () => {
    const limit = units.factor(kind) * Number(input.value.replace(",", "."));
    view.limits[kind] = limit > 0 ? limit : undefined;
    localStorage.setItem(`rotordrop limits ${keyOf(view)}`, JSON.stringify(view.limits));
    show();
  });
  return make("label", { of: [`Limit of ${text} `, input, ` ${units.unit(kind)}`] });
}

function show() {
  const { log } = view, sets = [...new Map([...log.drops, ...log.used].map((one) => [keyOf(one), one])).values()];
  address.note(() => ({ view: "log", machine: view.machine, bearings: view.bearings, force: view.limits.force, pressure: view.limits.pressure }));
  if (!sets.length) {
    by("log").replaceChildren(make("p", { text: log.problem || "No drop is logged yet. Add puts an estimated drop of the list into the log." }));
    return;
  }
  const choice = make("select", { "aria-label": "Machine and bearings", of: sets.map((one) => make("option", { value: keyOf(one), text: `${one.machine}, bearings ${one.bearings}`, selected: keyOf(one) === keyOf(view) ? "" : null })) });
  choice.addEventListener("change", () => { const [machine, bearings] = JSON.parse(choice.value); address.go({ view: "log", machine, bearings }); });
  const drops = here(), canvas = make("canvas", { class: "trend", role: "img", "aria-label": FIGURES.map(([field, , title]) => `${title}: ${drops.map((drop) => `drop ${drop.log} ${drop.numbers.filter((one) => one.field === field).map((one) => `${one.bearing} ${one[units.chosen()].filter(Boolean).join(", ")}`).join("; ")}`).join(". ")}`).join(". ") });
  const used = log.used.find((one) => keyOf(one) === keyOf(view)), said = [...(used ? [{ text: `${used.sentence}.`, level: used.passed ? "bad" : "notice" }] : []), ...FIGURES.flatMap(passed),
    ...log.trends.filter((text) => text.startsWith(`${view.machine}, bearings ${view.bearings}:`)).map((text) => ({ text, level: "warning" })),
    ...(used && used.allowed === null ? [{ text: "Nobody has stated how many drops are allowed; 'As command' of the menu ⋯ shows how it is stated.", level: "notice" }] : [])];
  const rows = drops.map((drop) => {
    const job = view.jobs.find((one) => one.row?.sha256 === drop.sha256 && drop.sha256);
    return make("tr", { of: [make("th", { scope: "row", text: String(drop.log) }), make("td", { text: units.minuteText(drop.recorded) || `logged ${units.minuteText(drop.added)}` }),
      make("td", { of: [job ? make("a", { href: address.of({ drop: job.id }), text: job.name }) : make("span", { text: drop.name }), ...(drop.simulated ? [make("span", { class: "tag sim", text: "simulated" })] : [])] }),
      make("td", { class: "number", text: drop.speed[units.chosen()][0] }), make("td", { class: "number", text: drop.duration ? drop.duration[units.chosen()][0] : "–" }),
      numberCell(worst(drop, "peak_force_N")), numberCell(worst(drop, "peak_stress_Pa")), make("td", { text: drop.cause })] });
  });
  by("log").replaceChildren(
    make("div", { class: "tools", of: [choice, limitField("force", "force"), limitField("pressure", "stress"), files("Log", {
      csv: () => keep(new Blob([csv()], { type: "text/csv" }), `${name()}.csv`), svg: () => keepSvg(picture(), name()), png: () => keepPng(picture(), name()), python: () => showLines(python()), command: () => showLines(command(), "As command")
    })] }), make("ul", { class: "statements", of: said.map(sentence) }), canvas,
    make("div", { class: "table", of: [make("table", { class: "drops", of: [make("caption", { text: `Drops logged in ${log.name}` }), make("thead", { of: [make("tr", { of: ["drop", "date", "record", "speed", "duration", "peak force, 90 %", "peak stress, 90 %", "cause"].map((text, i) => make("th", { scope: "col", text, class: i > 2 && i < 7 ? "number" : null })) })] }), make("tbody", { of: rows })] })] }),
    make("p", { class: "small", text: log.statement }));
  requestAnimationFrame(redrawLog);
}
export function redrawLog() {
  const canvas = by("log").querySelector("canvas");
  if (canvas && !by("log").hidden) { drawTrends(canvasPen(canvas)); }
}

export async function showLog(told) {
  by("log").hidden = false;
  const [log, { jobs }] = await Promise.all([server.log(), server.jobs()]);
  const sets = [...log.drops, ...log.used], found = sets.find((one) => one.machine === told.machine && (one.bearings === told.bearings || !told.bearings)) || sets.at(-1) || { machine: "", bearings: "" };
  units.learn(log.units);
  Object.assign(view, { log, jobs, machine: found.machine, bearings: found.bearings });
  let kept = {};
  try { kept = JSON.parse(localStorage.getItem(`rotordrop limits ${keyOf(view)}`)) || {}; } catch { kept = {}; }
  const limit = (kind) => (Number(told[kind]) > 0 ? Number(told[kind]) : kept[kind]);
  view.limits = { force: limit("force"), pressure: limit("pressure") };
  by("status").replaceChildren();
  say(`${log.drops.length} ${log.drops.length === 1 ? "drop" : "drops"} in the log.`, "notice");
  if (log.problem) { say(log.problem, "bad"); }
  show();
}
export const redoLog = () => view.log && show();
