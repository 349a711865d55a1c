// Where the shaft centre is on average, turn by turn, in its clearance circle.
import { canvasPen, colours, faint, keep, keepPng, keepSvg, svgPen } from "./figures.js";
import { fileName, files, origin, showLines, state, zero } from "./state.js";
import { make } from "./tables.js";
import * as units from "./units.js";

const LABELS = 6;
function drawOne(pen, place, { x, y }, { time, speed }, left, size) {
  const tone = colours(), cx = left + size / 2, cy = pen.height / 2 + 6, radius = size / 2 - 24;
  let reach = place.gap ? place.gap[1] : 0;
  x.forEach((v, i) => { if (v !== null) { reach = Math.max(reach, Math.hypot(v, y[i])); } });
  const scale = radius / (1.04 * (reach || 1)), at = (i) => (x[i] === null ? [NaN, NaN] : [cx + scale * x[i], cy - scale * y[i]]);
  pen.line([[cx - radius, cy], [cx + radius, cy]], tone.line);
  pen.line([[cx, cy - radius], [cx, cy + radius]], tone.line);
  if (place.gap) { pen.circle(cx, cy, scale * place.gap[1], tone.limit, 1.2); }
  pen.line(x.map((_, i) => at(i)), faint(tone.estimated, 0.7), 1.2);
  const named = []; // boxes of the labels: a shaft at rest would write all of them over each other
  const clear = (box) => named.every((other) => box[2] <= other[0] || other[2] <= box[0] || box[3] <= other[1] || other[3] <= box[1]);
  x.forEach((v, i) => {
    if (v === null) { return; }
    const [px, py] = at(i);
    pen.circle(px, py, 1.6, null, 0, tone.estimated);
    if (i % Math.ceil(x.length / LABELS) === 0 || i === x.length - 1) {
      const words = speed && speed[i] > 0 ? units.shown(speed[i], "speed", 3) : units.eventText(time[i] - zero()), width = 6 * words.length;
      const places = [[px + 6, py - 4], [px - 6 - width, py - 4], [px + 6, py + 14], [px - 6 - width, py + 14]].map(([a, b]) => [a, b - 10, a + width, b + 2]);
      const box = places.find(clear);
      if (!box) { return; }
      named.push(box);
      pen.circle(px, py, 3.2, tone.back, 1, tone.ink);
      pen.text(words, box[0], box[3] - 2, tone.ink, { size: 10 });
    }
  });
  pen.text(`${place.name}, mean of ${units.timeText(time[1] - time[0], time[1] - time[0])}`, left + 6, 14, tone.ink, { size: 12, weight: "600" });
}
function draw(pen) {
  const { centreline, places } = state.look, size = Math.min(pen.width / places.length, pen.height);
  places.forEach((place, i) => drawOne(pen, place, centreline.planes[i], centreline, i * size, size));
}
const picture = () => { const pen = svgPen(460 * state.look.places.length, 460, colours().back, "Shaft centreline"); draw(pen); return pen; };
const csv = () => {
  const { centreline: { time, speed, planes }, places } = state.look;
  return [[`time from ${origin()} [s]`, "speed [rad/s]", ...places.flatMap(({ name }) => [`${name} x [m]`, `${name} y [m]`])].map((text) => JSON.stringify(text)).join(","),
    ...time.map((t, i) => [t - zero(), speed ? speed[i] : "", ...planes.flatMap(({ x, y }) => [x[i] ?? "", y[i] ?? ""])].join(",")), ""].join("\n");
};
export function centrelineTab() {
  const { centreline, places, python, command } = state.look;
  if (!centreline || centreline.time.length < 2) { return [make("p", { text: centreline ? "The record is too short for a centreline." : "This was looked at by an earlier version; look again to see the centreline." })]; }
  const words = places.map(({ name }, i) => { const { x, y } = centreline.planes[i]; return `${name} from ${units.shown(x[0], "length", 3)}, ${units.shown(y[0], "length", 3)} to ${units.shown(x.at(-1), "length", 3)}, ${units.shown(y.at(-1), "length", 3)}`; }).join("; ");
  const canvas = make("canvas", { class: "centreline", role: "img", "aria-label": `Shaft centreline: ${words}` });
  requestAnimationFrame(() => { if (canvas.isConnected) { draw(canvasPen(canvas)); } });
  return [make("figure", { of: [canvas, make("header", { class: "right", of: [files("Shaft centreline", {
    csv: () => keep(new Blob([csv()], { type: "text/csv" }), `${fileName("centreline")}.csv`), svg: () => keepSvg(picture(), fileName("centreline")), png: () => keepPng(picture(), fileName("centreline")),
    python: () => showLines(python["motion 0"]), command: command && (() => showLines(command, "As command"))
  })] })] }), make("p", { class: "small", text: `The whole record in the sensor planes; each point is a mean over a turn at the speed of the release, or more. Numbers are shaft speeds, or times from ${origin()} where no speed is known.` })];
}
