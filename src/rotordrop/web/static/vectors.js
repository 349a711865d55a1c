// Vectors of 1X and 2X of a recorded coast-down: Bode and polar plot, with the slow-roll vector taken off.
import { colours, placeColour, ticks } from "./figures.js";
import * as units from "./units.js";

const AXES = ["x", "y"];
const hz = (speed) => speed / (2 * Math.PI);

// The vector of an axis in every row, less that of the row whose speed is nearest to the slow one; null where it is not known.
export function vectors({ speed, orders }, order, slow) {
  const near = (rows) => rows.reduce((best, row, i) => (row[0] !== null && (best < 0 || Math.abs(hz(speed[i]) - slow) < Math.abs(hz(speed[best]) - slow)) ? i : best), -1);
  return Object.fromEntries(AXES.map((axis) => {
    const rows = orders[order][axis], at = slow > 0 ? near(rows) : -1, [re, im, own] = at < 0 ? [0, 0, 0] : rows[at];
    return [axis, { rows: rows.map((row, i) => (row[0] === null ? null : { speed: hz(speed[i]), re: row[0] - re, im: row[1] - im, error: Math.hypot(row[2], own) })), taken: at < 0 ? null : { speed: hz(speed[at]), size: Math.hypot(re, im), angle: Math.atan2(im, re) } }];
  }));
}
const degrees = (angle) => (180 / Math.PI) * angle;
export const takenWords = (found) => AXES.filter((axis) => found[axis].taken).map((axis) => `${axis}: ${units.shown(found[axis].taken.size, "length", 3)} at ${units.fixed(degrees(found[axis].taken.angle), 0)}°, ${units.fixed(found[axis].taken.speed, 2)} Hz`).join("; ");

function keyOf(pen, tone, left, top) { AXES.forEach((axis, k) => { pen.line([[left + 44 * k, top - 4], [left + 44 * k + 18, top - 4]], placeColour(tone, k), 2); pen.text(axis, left + 44 * k + 22, top, tone.ink); }); }

function frame(pen, tone, box, x, y, label, words) {
  const px = (v) => box.left + ((v - x[0]) / (x[1] - x[0])) * (box.right - box.left), py = (v) => box.bottom - ((v - y[0]) / (y[1] - y[0])) * (box.bottom - box.top);
  for (const v of ticks(...x, 6)) { pen.line([[px(v), box.top], [px(v), box.bottom]], tone.line); if (words) { pen.text(String(v), px(v), box.bottom + 14, tone.ink, { align: "center", size: 10 }); } }
  for (const v of y[1] - y[0] === 360 ? [-180, -90, 0, 90, 180] : ticks(...y, 5)) { pen.line([[box.left, py(v)], [box.right, py(v)]], tone.line); pen.text(String(v).replace("-", "−"), box.left - 5, py(v) + 4, tone.ink, { align: "right", size: 10 }); }
  pen.text(label, box.left, box.top - 7, tone.ink, { size: 12, weight: "600" });
  if (words) { pen.text(words, (box.left + box.right) / 2, box.bottom + 29, tone.ink, { align: "center" }); }
  return [px, py];
}

export function drawBode(pen, told, order, slow, mark) {
  const tone = colours(), found = vectors(told, order, slow), f = units.factor("length"), known = AXES.flatMap((axis) => found[axis].rows.filter(Boolean));
  if (!known.length) { pen.text(`${order}X stands nowhere alone in this record.`, 12, 20, tone.ink); return; }
  const fastest = Math.max(...known.map((row) => row.speed)), high = 1.08 * Math.max(...known.map((row) => Math.hypot(row.re, row.im) / f)), middle = 0.56 * pen.height;
  const x = [0, 1.02 * fastest], where = { left: 52, right: pen.width - 12 };
  const [px, py] = frame(pen, tone, { ...where, top: 24, bottom: middle - 16 }, x, [0, high], `${order}X amplitude, zero to peak [${units.unit("length")}], 90 %${slow > 0 ? ", slow roll taken off" : ""}`);
  keyOf(pen, tone, where.right - 90, 17);
  const [, phase] = frame(pen, tone, { ...where, top: middle + 20, bottom: pen.height - 40 }, x, [-180, 180], `phase of ${order}X [°], from the shaft's angle since power-off`, "shaft speed [Hz]");
  AXES.forEach((axis, k) => {
    const rows = found[axis].rows, size = (row) => Math.hypot(row.re, row.im) / f;
    for (const row of rows.filter((one, i) => one && i % Math.ceil(rows.length / 120) === 0)) { pen.line([[px(row.speed), py(Math.max(size(row) - (1.645 * row.error) / f, 0))], [px(row.speed), py(Math.min(size(row) + (1.645 * row.error) / f, high))]], placeColour(tone, k), 0.5); }
    pen.line(rows.map((row) => (row ? [px(row.speed), py(size(row))] : [NaN, NaN])), placeColour(tone, k), 1.6);
    let before = null;
    pen.line(rows.flatMap((row) => {
      if (!row) { before = null; return [[NaN, NaN]]; }
      const angle = degrees(Math.atan2(row.im, row.re)), jumped = before !== null && Math.abs(angle - before) > 180;
      before = angle;
      return [...(jumped ? [[NaN, NaN]] : []), [px(row.speed), phase(angle)]];
    }), placeColour(tone, k), 1.6);
  });
  if (mark > 0 && mark <= x[1]) { for (const [top, bottom] of [[24, middle - 16], [middle + 20, pen.height - 40]]) { pen.line([[px(mark), top], [px(mark), bottom]], tone.limit, 1, [3, 3]); } }
}

export function drawPolar(pen, told, order, slow) {
  const tone = colours(), found = vectors(told, order, slow), f = units.factor("length"), known = AXES.flatMap((axis) => found[axis].rows.filter(Boolean));
  if (!known.length) { pen.text(`${order}X stands nowhere alone in this record.`, 12, 20, tone.ink); return; }
  const reach = Math.max(...known.map((row) => Math.hypot(row.re, row.im) / f)), cx = pen.width / 2, cy = pen.height / 2 + 2, radius = Math.min(pen.width, pen.height) / 2 - 44, scale = radius / (1.05 * reach);
  pen.text(`${order}X vector, zero to peak [${units.unit("length")}]${slow > 0 ? ", slow roll taken off" : ""}`, 10, 14, tone.ink, { size: 12, weight: "600" });
  keyOf(pen, tone, pen.width - 100, 14);
  for (const r of ticks(0, reach, 4).filter((v) => v > 0)) { pen.circle(cx, cy, scale * r, tone.line); pen.text(String(r), cx + scale * r * 0.71 + 2, cy - scale * r * 0.71, tone.muted, { size: 10 }); }
  for (const angle of [0, 90, 180, 270]) {
    const [c, s] = [Math.cos((angle * Math.PI) / 180), Math.sin((angle * Math.PI) / 180)];
    pen.line([[cx, cy], [cx + radius * c, cy - radius * s]], tone.line);
    pen.text(`${angle}°`, cx + (radius + 14) * c, cy - (radius + 14) * s + 4, tone.ink, { align: "center", size: 10 });
  }
  AXES.forEach((axis, k) => {
    const rows = found[axis].rows, at = (row) => [cx + (scale * row.re) / f, cy - (scale * row.im) / f];
    pen.line(rows.map((row) => (row ? at(row) : [NaN, NaN])), placeColour(tone, k), 1.5);
    let last = Infinity;
    for (const row of rows.filter(Boolean)) {
      const step = Math.max(...known.map((one) => one.speed)) / 6;
      if (last - row.speed > step || last === Infinity) { last = row.speed; const [x, y] = at(row); pen.circle(x, y, 2.5, null, 0, placeColour(tone, k)); pen.text(units.fixed(row.speed, 0), x + 4, y - 4, placeColour(tone, k), { size: 10 }); }
    }
  });
  pen.text("numbers: shaft speed [Hz]; angle: against that of the shaft since power-off", cx, pen.height - 4, tone.muted, { align: "center", size: 10 });
}

export const vectorsCsv = (told, order, slow) => {
  const found = vectors(told, order, slow);
  return [`time [s],speed [Hz],${AXES.flatMap((axis) => [`${axis} ${order}X real [m]`, `${axis} ${order}X imaginary [m]`, `${axis} standard error [m]`]).join(",")}`,
    ...told.time.map((t, i) => [t, hz(told.speed[i]), ...AXES.flatMap((axis) => { const row = found[axis].rows[i]; return row ? [row.re, row.im, row.error] : ["", "", ""]; })].join(",")), ""].join("\n");
};
