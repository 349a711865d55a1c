// The waterfall: a map of amplitude over frequency and time, its orders and lines, and a cut through one of them.
import { canvasPen, colours, keep, keepPng, keepSvg, svgPen, ticks } from "./figures.js";
import { make } from "./tables.js";
import * as server from "./server.js";
import * as units from "./units.js";
import { drawBode, drawPolar, takenWords, vectors, vectorsCsv } from "./vectors.js";

const by = (id) => document.getElementById(id);
const VIRIDIS = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]];
const PARTS = { full: "full spectrum, backward to the left", y: "vertical", x: "horizontal" };
const fall = { id: null, page: null, plane: 0, part: "full", field: null, to: 0, at: null, line: null, heat: null };

const frequencies = () => fall.page.frequency[fall.part];
const span = () => [fall.part === "full" ? -fall.to : 0, fall.to];
const linesHere = () => fall.page.lines.filter((line) => line.planes.includes(fall.page.planes[fall.plane]));
const value = (frame, bin) => fall.field[frame * frequencies().length + bin];
function binOf(frequency) {
  const all = frequencies(), step = (all.at(-1) - all[0]) / (all.length - 1);
  return Math.min(Math.max(Math.round((frequency - all[0]) / step), 0), all.length - 1);
}
function along({ time, frequency }, t) {
  if (t < time[0] || t > time.at(-1)) { return NaN; }
  const after = time.findIndex((one) => one >= t), before = Math.max(after - 1, 0);
  const share = after === before ? 0 : (t - time[before]) / (time[after] - time[before]);
  return frequency[before] + share * (frequency[after] - frequency[before]);
}
const frameOf = (t) => fall.page.time.reduce((best, one, i) => (Math.abs(one - t) < Math.abs(fall.page.time[best] - t) ? i : best), 0);

export async function openFall(id, page) {
  if (fall.id !== id || fall.page !== page) {
    Object.assign(fall, { id, page, plane: 0, part: page.parts[0], to: page.highest, at: null, line: null });
    units.learn(page.units);
    by("fallplane").replaceChildren(...page.planes.map((name, i) => make("option", { value: i, text: name })));
    by("fallpart").replaceChildren(...page.parts.map((part) => make("option", { value: part, text: PARTS[part] })));
    by("fallto").value = Number(page.highest.toPrecision(4));
    fall.line = linesHere()[0] || null; // its course fills the figure beside the map from the beginning
  }
  await load();
}

async function load() {
  const { id, plane, part } = fall;
  const field = await server.field(id, plane, part);
  if (fall.id !== id || fall.plane !== plane || fall.part !== part) { return; }
  fall.field = field;
  fall.heat = null;
  drawFall();
}

// The largest of neighbouring values stands for a column, so that no line is lost between pixels.
function heat() {
  if (fall.heat) { return fall.heat; }
  const [low, high] = span(), first = binOf(low), last = binOf(high), frames = fall.page.time.length;
  const columns = Math.min(last - first + 1, 1200), each = (last - first + 1) / columns;
  const canvas = make("canvas", { width: columns, height: frames }), c = canvas.getContext("2d"), image = c.createImageData(columns, frames);
  const sorted = Float32Array.from(fall.field).sort(), top = Math.log10(sorted.at(-1));
  const floor = Math.log10(Math.max(sorted[sorted.length >> 1], 1e-5 * sorted.at(-1)));
  for (let row = 0; row < frames; row += 1) {
    for (let column = 0; column < columns; column += 1) {
      let most = 0;
      for (let bin = first + Math.floor(column * each); bin < first + Math.floor((column + 1) * each); bin += 1) { most = Math.max(most, value(row, bin)); }
      const share = 8 * Math.min(Math.max((Math.log10(most || 1e-30) - floor) / (top - floor), 0), 1), stop = Math.min(Math.floor(share), 7);
      const at = 4 * ((frames - 1 - row) * columns + column);
      for (let k = 0; k < 3; k += 1) { image.data[at + k] = VIRIDIS[stop][k] + (share - stop) * (VIRIDIS[stop + 1][k] - VIRIDIS[stop][k]); }
      image.data[at + 3] = 255;
    }
  }
  c.putImageData(image, 0, 0);
  fall.heat = { canvas, floor: 10 ** floor, top: 10 ** top };
  return fall.heat;
}

function frameBox(pen) {
  const { time } = fall.page, [low, high] = span(), step = time.length > 1 ? time[1] - time[0] : 1;
  const box = { left: 56, right: pen.width - 84, top: 22, bottom: pen.height - 40 }, begin = time[0] - step / 2, end = time.at(-1) + step / 2;
  return { box, begin, end,
    px: (f) => box.left + ((f - low) / (high - low)) * (box.right - box.left),
    py: (t) => box.bottom - ((t - begin) / (end - begin)) * (box.bottom - box.top) };
}

function axes(pen, { box, px, py, begin, end }, tone) {
  for (const f of ticks(...span(), 8)) { pen.text(String(f).replace("-", "−"), px(f), box.bottom + 14, tone.ink, { align: "center" }); }
  for (const t of ticks(begin, end, 6)) { pen.text(String(t), box.left - 6, py(t) + 4, tone.ink, { align: "right" }); }
  pen.text("frequency [Hz]", (box.left + box.right) / 2, pen.height - 8, tone.ink, { align: "center", size: 12 });
  pen.text("time from power-off [s]", 14, (box.top + box.bottom) / 2, tone.ink, { align: "center", size: 12, turned: true });
}

function colourBar(pen, { box }, tone) {
  const { floor, top } = heat(), left = box.right + 12, height = box.bottom - box.top;
  for (let k = 0; k < 40; k += 1) {
    const share = (8 * k) / 40, stop = Math.floor(share), part = VIRIDIS[stop].map((v, i) => Math.round(v + (share - stop) * (VIRIDIS[stop + 1][i] - v)));
    const y = box.bottom - (height * k) / 40, up = height / 40 + 0.5;
    pen.area([[left, y], [left + 10, y], [left + 10, y - up], [left, y - up]], `rgb(${part.join(",")})`);
  }
  const f = units.factor("length");
  for (let power = Math.ceil(Math.log10(floor / f)); power <= Math.log10(top / f); power += 1) {
    const y = box.bottom - (height * (power - Math.log10(floor / f))) / Math.log10(top / floor);
    pen.text(`${Number((10 ** power).toPrecision(1))}`, left + 14, y + 4, tone.ink, { size: 10 });
  }
  pen.text(units.unit("length"), left, box.top - 8, tone.ink, { size: 11 });
}

// Spectra one above the other, as many as can be told apart, each before those that came later.
const MOST_SPECTRA = 60;
function drawCascade(pen, withCursor) {
  const tone = colours(), frame = frameBox(pen), { box, px, py } = frame, { time } = fall.page, [low, high] = span(), first = binOf(low), last = binOf(high);
  const each = Math.max(1, Math.ceil(time.length / MOST_SPECTRA)), tall = Math.max(40, (3 * (box.bottom - box.top) * each) / time.length), top = heat().top;
  for (let row = Math.floor((time.length - 1) / each) * each; row >= 0; row -= each) {
    const points = [], base = py(time[row]);
    for (let bin = first; bin <= last; bin += 1) { points.push([px(frequencies()[bin]), Math.max(base - (tall * value(row, bin)) / top, 4)]); }
    pen.area([[points[0][0], base], ...points, [points.at(-1)[0], base]], tone.back);
    pen.line(points, tone.estimated, 0.8);
  }
  if (withCursor && fall.at) { pen.line([[px(fall.at.f), box.top], [px(fall.at.f), box.bottom]], tone.limit, 1); pen.line([[box.left, py(fall.at.t)], [box.right, py(fall.at.t)]], tone.limit, 1); }
  axes(pen, frame, tone);
  pen.text(`${units.shown(top, "length", 2)} is ${Math.round((100 * tall) / (box.bottom - box.top))} % of the height`, box.right, box.top - 8, tone.muted, { align: "right", size: 10 });
}

function drawMap(pen, withCursor) {
  if (by("fallas").value === "cascade") { drawCascade(pen, withCursor); return; }
  const tone = colours(), frame = frameBox(pen), { box, px, py } = frame, { time, speed, orders } = fall.page;
  pen.image(heat().canvas, box.left, box.top, box.right - box.left, box.bottom - box.top);
  const inside = (f) => (f >= span()[0] && f <= span()[1] ? px(f) : NaN);
  if (speed && by("fallorders").checked) {
    for (const order of fall.part === "full" ? [...orders.map((k) => -k), ...orders] : orders) {
      const points = time.map((t, i) => [inside(order * speed[i]), py(t)]), seen = points.find(([x]) => Number.isFinite(x));
      pen.line(points, "#ffffff", 0.9, [4, 3]);
      if (seen) {
        const atEnd = seen[0] > box.right - 30;
        pen.text(`${order}X`.replace("-", "−"), seen[0] + (atEnd ? -3 : 3), seen[1] - 3, "#ffffff", { size: 10.5, weight: "600", align: atEnd ? "right" : "left" });
      }
    }
  }
  let last = -Infinity;
  for (const line of [...linesHere()].sort((a, b) => a.frequency - b.frequency)) {
    const chosen = line === fall.line;
    if (line.kind === "order" && !chosen) { continue; }
    pen.line(line.path.time.map((t, i) => [t < frame.begin || t > frame.end ? NaN : inside(line.path.frequency[i]), py(t)]), chosen ? "#ff4d4d" : "#ffffff", chosen ? 2 : 0.7, chosen ? [] : [1, 3]);
    const x = line.kind === "order" ? NaN : inside(line.frequency);
    if (Number.isFinite(x) && x - last > 34) { pen.text(line.frequency.toFixed(1), x, box.top - 6, chosen ? tone.limit : tone.ink, { align: "center", size: 10 }); last = x; }
  }
  if (withCursor && fall.at) {
    pen.line([[px(fall.at.f), box.top], [px(fall.at.f), box.bottom]], "#ffffff", 1);
    pen.line([[box.left, py(fall.at.t)], [box.right, py(fall.at.t)]], "#ffffff", 1);
  }
  axes(pen, frame, tone);
  colourBar(pen, frame, tone);
}

// Amplitude of a line in every frame: the largest value within one resolution of where it is then.
function courseOf(line) {
  return line.frames.map((f, row) => (f === null ? NaN
    : Math.max(...(fall.part === "full" ? [f, -f] : [f]).flatMap((one) => [-1, 0, 1].map((k) => value(row, Math.min(Math.max(binOf(one) + k, 0), frequencies().length - 1))))))
  );
}

// Round numbers of a logarithmic scale between two powers of ten: decades, or 1, 2 and 5, or at equal distances.
export function scaleOf(low, high) {
  const within = (parts) => Array.from({ length: Math.ceil(high) - Math.floor(low) + 1 }, (_, k) => parts.map((part) => Number((part * 10 ** (Math.floor(low) + k)).toPrecision(1)))).flat()
    .filter((one) => Math.log10(one) >= low && Math.log10(one) <= high);
  return [within([1]), within([1, 2, 5])].find((some) => some.length > 2) || ticks(10 ** low, 10 ** high, 4);
}

function drawCut(pen, box, { x, y, title, label, mark }) {
  const tone = colours(), f = units.factor("length"), known = y.filter((v) => v > 0);
  if (!known.length) { pen.text(title, box.left, box.top - 6, tone.ink, { size: 12, weight: "600" }); return; }
  const high = Math.log10(Math.max(...known) / f) + 0.1, low = Math.max(Math.log10(Math.min(...known) / f), high - 5);
  const px = (v) => box.left + ((v - x[0]) / (x.at(-1) - x[0])) * (box.right - box.left);
  const py = (v) => box.bottom - ((Math.log10(v / f) - low) / (high - low)) * (box.bottom - box.top);
  for (const v of scaleOf(low, high)) {
    pen.line([[box.left, py(f * v)], [box.right, py(f * v)]], tone.line);
    pen.text(String(v), box.left - 5, py(f * v) + 4, tone.ink, { align: "right", size: 10 });
  }
  pen.text(`amplitude [${units.unit("length")}]`, 12, (box.top + box.bottom) / 2, tone.ink, { align: "center", size: 11, turned: true });
  for (const v of ticks(x[0], x.at(-1), 6)) { pen.text(String(v).replace("-", "−"), px(v), box.bottom + 13, tone.ink, { align: "center", size: 10 }); }
  pen.line(x.map((v, i) => [px(v), y[i] > 0 ? Math.min(py(y[i]), box.bottom) : NaN]), tone.estimated, 1.2);
  if (Number.isFinite(mark)) { pen.line([[px(mark), box.top], [px(mark), box.bottom]], tone.limit, 1, [3, 3]); }
  pen.text(title, box.left, box.top - 6, tone.ink, { size: 12, weight: "600" });
  pen.text(label, (box.left + box.right) / 2, box.bottom + 28, tone.ink, { align: "center", size: 11 });
}

const NEEDED = " (needs the shaft speed)";
const cutFrame = () => (fall.at ? frameOf(fall.at.t) : 0);
const tracked = () => fall.page.orders_tracked?.[fall.page.planes[fall.plane]];
const shows = () => (tracked() && by("fallshow").value !== "cuts" ? by("fallshow").value.split(" ") : null);
const slowRoll = () => Number(by("slowroll").value.replace(",", "."));
function drawCuts(pen) {
  if (shows()) {
    const [kind, order] = shows(), at = fall.at && fall.page.speed ? fall.page.speed[frameOf(fall.at.t)] : NaN;
    if (kind === "bode") { drawBode(pen, tracked(), order, slowRoll(), at); } else { drawPolar(pen, tracked(), order, slowRoll()); }
    return;
  }
  const [low, high] = span(), first = binOf(low), last = binOf(high), frame = cutFrame(), middle = pen.height / 2;
  const x = frequencies().slice(first, last + 1), where = { left: 60, right: pen.width - 10 };
  drawCut(pen, { ...where, top: 20, bottom: middle - 36 }, { x, y: x.map((_, i) => value(frame, first + i)), mark: fall.at ? fall.at.f : NaN,
    title: `Spectrum at ${units.fixed(fall.page.time[frame], 2)} s, ${fall.page.amplitude_kind}`, label: "frequency [Hz]" });
  if (fall.line) {
    drawCut(pen, { ...where, top: middle + 20, bottom: pen.height - 36 }, { x: fall.page.time, y: courseOf(fall.line), mark: fall.at ? fall.at.t : NaN,
      title: `${fall.line.label} over time`, label: "time from power-off [s]" });
  }
}

function readFall() {
  if (!fall.at) { by("fallclock").textContent = "point at the map, or choose a line"; return; }
  const frame = frameOf(fall.at.t), speed = fall.page.speed && fall.page.speed[frame];
  const order = speed > 0.5 ? `, ${units.fixed(fall.at.f / speed, 3)} X at ${units.shown(2 * Math.PI * speed, "speed")}` : "";
  if (document.activeElement !== by("sliceat")) { by("sliceat").value = speed > 0 ? units.fixed(speed, 2) : ""; }
  by("fallclock").textContent = `${units.fixed(fall.at.f, 2)} Hz, ${units.fixed(fall.page.time[frame], 2)} s: ${units.shown(value(frame, binOf(fall.at.f)), "length", 3)}${order}`;
}

function lineList() {
  const cell = ({ SI, US }) => (units.chosen() === "SI" ? SI : US)[0];
  by("falllines").replaceChildren(make("table", { of: [make("caption", { text: "Lines: a click shows cut, name and reason" }),
    make("tbody", { of: linesHere().map((line) => make("tr", { class: line === fall.line ? "here" : null, on: { click: () => choose(line) }, of: [
      make("th", { scope: "row", of: [make("button", { class: "link", text: line.label, "aria-pressed": String(line === fall.line), on: { click: (event) => { event.stopPropagation(); choose(line); } } })] }),
      make("td", { class: "number", text: line.where }), make("td", { class: "number", text: cell(line.amplitude) })] })) })] }),
  ...(fall.line ? [make("p", { class: "reason", of: [make("strong", { text: fall.line.label }), make("span", { text: ` (${fall.line.named ? `confidence ${cell(fall.line.confidence)}` : "no name"}, seen from ${fall.line.seen}): ${fall.line.reason}` })] })] : []));
}

function choose(line) {
  fall.line = line;
  const seen = Math.max(0, line.path.time.findIndex((t) => t >= fall.page.time[0]));
  fall.at = { t: line.path.time[Math.min(seen, line.path.time.length - 1)], f: line.frequency };
  if (line.frequency > fall.to) { setTo(1.2 * line.frequency); }
  drawFall();
  const button = [...by("falllines").querySelectorAll("button")][linesHere().indexOf(line)];
  if (button) { button.focus(); }
}

export function drawFall() {
  if (!fall.field || by("fall").hidden) { return; }
  drawMap(canvasPen(by("fallmap")), true);
  drawCuts(canvasPen(by("fallcut")));
  by("fallmap").setAttribute("aria-label", `Waterfall of ${fall.page.planes[fall.plane]}, ${PARTS[fall.part]}, to ${Math.round(fall.to)} Hz; arrow keys move the cursor`);
  by("fallcut").setAttribute("aria-label", shows() ? `${shows()[0] === "bode" ? "Bode" : "Polar"} plot of ${shows()[1]}X at ${fall.page.planes[fall.plane]}` : "Spectrum at the cursor and the chosen line over time");
  by("slowwords").textContent = shows() && slowRoll() > 0 ? `taken off: ${takenWords(vectors(tracked(), shows()[1], slowRoll())) || "nothing, no speed is near"}` : "";
  for (const option of by("fallshow").options) { option.disabled = option.value !== "cuts" && !tracked(); option.textContent = option.textContent.replace(NEEDED, "") + (option.disabled ? NEEDED : ""); }
  by("slowlabel").hidden = !shows();
  readFall();
  lineList();
}

function setTo(to) {
  const most = frequencies().at(-1);
  if (!(to > 0)) { return; }
  fall.to = Math.min(to, most);
  fall.heat = null;
  by("fallto").value = Number(fall.to.toPrecision(4));
}

function picture(draw, title) {
  const pen = svgPen(1000, 640, colours().back, title);
  draw(pen);
  return pen;
}

const title = () => `waterfall_${fall.page.planes[fall.plane]}_${fall.part}`.replace(/[^\w.-]+/g, "_");
function csv() {
  const head = ["time [s]", ...frequencies().map((f) => `${f} Hz [m]`)].join(",");
  const rows = fall.page.time.map((t, i) => [t, ...frequencies().map((_, k) => value(i, k).toPrecision(7))].join(","));
  keep(new Blob([[head, ...rows, ""].join("\n")], { type: "text/csv" }), `${title()}.csv`);
}
export const fallFiles = {
  CSV: csv, SVG: () => keepSvg(picture((pen) => drawMap(pen, false), title()), title()), PNG: () => keepPng(picture((pen) => drawMap(pen, false), title()), title()),
  Python: () => fall.page.python[`${fall.plane} ${fall.part}`], Command: () => fall.page.command
};

// The spectrum at the cursor and, where a line is chosen, its course: one table under the other.
const cutTitle = () => `${title()}_${fall.page.time[cutFrame()].toFixed(2)}_s`;
function cutCsv() {
  if (shows()) { keep(new Blob([vectorsCsv(tracked(), shows()[1], slowRoll())], { type: "text/csv" }), `${title()}_${shows().join("_")}X.csv`); return; }
  const frame = cutFrame(), rows = [`frequency [Hz],amplitude at ${fall.page.time[frame]} s [m]`, ...Array.from(frequencies(), (f, k) => `${f},${value(frame, k).toPrecision(7)}`)];
  if (fall.line) { rows.push("", `time [s],${JSON.stringify(fall.line.label)} [m]`, ...courseOf(fall.line).map((v, i) => `${fall.page.time[i]},${Number.isFinite(v) ? v.toPrecision(7) : ""}`)); }
  keep(new Blob([[...rows, ""].join("\n")], { type: "text/csv" }), `${cutTitle()}.csv`);
}
export const cutFiles = {
  CSV: cutCsv, SVG: () => keepSvg(picture(drawCuts, cutTitle()), cutTitle()), PNG: () => keepPng(picture(drawCuts, cutTitle()), cutTitle()),
  Python: () => (shows() ? `${fallFiles.Python()}${tracked().python.replace("slow = 0.0", `slow = ${2 * Math.PI * (slowRoll() || 0)}`)}` : `${fallFiles.Python()}spectrum = amplitude[abs(time - ${fall.page.time[cutFrame()]}).argmin()]  # [m]\n${fall.line ? `\n${fall.line.python}` : ""}`)
};

const placeOf = (event) => {
  const { box, begin, end } = frameBox(canvasPen.size(by("fallmap"))), [low, high] = span(), inside = (v) => Math.min(Math.max(v, 0), 1);
  return { f: low + inside((event.offsetX - box.left) / (box.right - box.left)) * (high - low), t: begin + inside((box.bottom - event.offsetY) / (box.bottom - box.top)) * (end - begin) };
};
by("fallmap").addEventListener("pointermove", (event) => { if (fall.field) { fall.at = placeOf(event); drawFall(); } });
by("fallmap").addEventListener("click", (event) => {
  const at = placeOf(event), reach = 0.015 * (span()[1] - span()[0]);
  const near = linesHere().map((line) => [Math.abs(Math.abs(at.f) - along(line.path, at.t)), line]).filter(([apart]) => apart < reach).sort((a, b) => a[0] - b[0])[0];
  if (near) { fall.line = near[1]; }
  fall.at = at;
  drawFall();
});
by("fallmap").addEventListener("keydown", (event) => {
  const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
  if (!step || !fall.field) { return; }
  event.preventDefault();
  event.stopPropagation();
  const { time } = fall.page, wide = event.shiftKey ? 10 : 1, bin = binOf(fall.at ? fall.at.f : 0) + wide * step[0];
  const frame = Math.min(Math.max((fall.at ? frameOf(fall.at.t) : 0) + wide * step[1], 0), time.length - 1);
  fall.at = { f: Math.min(Math.max(frequencies()[Math.min(Math.max(bin, 0), frequencies().length - 1)], span()[0]), span()[1]), t: time[frame] };
  drawFall();
});
by("fallplane").addEventListener("change", () => { fall.plane = Number(by("fallplane").value); fall.line = null; load(); });
by("fallpart").addEventListener("change", () => { fall.part = by("fallpart").value; load(); });
by("fallto").addEventListener("change", () => { setTo(Number(by("fallto").value.replace(",", "."))); drawFall(); });
by("fallorders").addEventListener("change", drawFall);
for (const id of ["fallas", "fallshow", "slowroll"]) { by(id).addEventListener("change", () => { drawFall(); document.dispatchEvent(new Event("seen")); }); }
// A slice at a speed: the frame in which the shaft turned nearest to it.
by("sliceat").addEventListener("change", () => {
  const speed = Number(by("sliceat").value.replace(",", ".")), { speed: all, time } = fall.page;
  if (!(speed > 0) || !all) { return; }
  const row = all.reduce((best, one, i) => (Math.abs(one - speed) < Math.abs(all[best] - speed) ? i : best), 0);
  fall.at = { t: time[row], f: fall.at ? fall.at.f : speed };
  drawFall();
});
// What of the waterfall stands in the address, and how it comes back from there.
export const fallSeen = () => ({ plane: fall.plane || "", part: by("fallpart").value, as: by("fallas").value === "map" ? "" : by("fallas").value, cut: by("fallshow").value === "cuts" ? "" : by("fallshow").value, slow: by("slowroll").value });
export function fallWanted(told) {
  by("fallas").value = told.as === "cascade" ? "cascade" : "map";
  by("fallshow").value = [...by("fallshow").options].some((one) => one.value === told.cut) ? told.cut : "cuts";
  by("slowroll").value = told.slow || "";
}
