// The path of the shaft centre in its clearance circle, with the force, at the cursor.
import { arrow, colours, faint } from "./figures.js";
import { factor, shown, unit, written } from "./units.js";

export const nearest = (time, t) => {
  let low = 0, high = time.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (time[middle] <= t) { low = middle; } else { high = middle; }
  }
  return t - time[low] < time[high] - t ? low : high;
};

// paths: [{role, time, x, y}]; force: {value, largest} or null; impacts: azimuths; angle of the shaft or null
export function drawOrbit(pen, { name, gap, gapIs, paths, cursor, force, impacts, angle }) {
  const tone = colours(), size = Math.min(pen.width, pen.height);
  const cx = pen.width / 2, cy = pen.height / 2 + 4, radius = 0.5 * size - 26;
  let reach = gap ? gap[1] : 0;
  for (const { x, y } of paths) {
    for (let i = 0; i < x.length; i += 1) { reach = Math.max(reach, Math.hypot(x[i], y[i]) || 0); }
  }
  const scale = radius / (1.04 * (reach || 1)), at = (x, y) => [cx + scale * x, cy - scale * y];
  pen.line([[cx - radius, cy], [cx + radius, cy]], tone.line);
  pen.line([[cx, cy - radius], [cx, cy + radius]], tone.line);
  if (gap) {
    pen.circle(cx, cy, scale * gap[1], tone.limit, 1.2);
    if (gap[1] - gap[0] > 1e-6) { pen.circle(cx, cy, scale * gap[0], tone.limit, 1, null, [4, 3]); }
    for (const azimuth of impacts) {
      const tick = (share) => at(share * gap[1] * Math.cos(azimuth), share * gap[1] * Math.sin(azimuth));
      pen.line([tick(1.0), tick(1.07)], tone.muted, 1.5);
    }
  }
  for (const { role, x, y } of paths) {
    pen.line(Array.from(x, (v, i) => at(v, y[i])), role === "estimated" ? faint(tone.estimated, 0.6) : tone[role], role === "measured" ? 0.9 : 2.4);
  }
  for (const { role, time, x, y } of paths) {
    if (cursor === null || !time.length) { continue; }
    const here = nearest(time, cursor), [px, py] = at(x[here], y[here]);
    if (!Number.isFinite(px)) { continue; }
    if (role === "estimated" && force && force.value > 0) {
      const length = Math.hypot(x[here], y[here]) || 1, far = 0.42 * radius * Math.sqrt(force.value / force.largest);
      arrow(pen, [px, py], [px - (far * x[here]) / length, py + (far * y[here]) / length], tone.limit, 2);
    }
    pen.circle(px, py, role === "measured" ? 3 : 5, tone.back, 1, tone[role]);
    if (role === paths[paths.length - 1].role && angle !== null) {
      pen.circle(px, py, 9, tone.muted, 1);
      pen.circle(px + 9 * Math.cos(angle), py - 9 * Math.sin(angle), 2, null, 0, tone.ink);
    }
  }
  pen.text(name, 6, 14, tone.ink, { size: 12.5, weight: "600" });
  if (gap) {
    const known = gap[1] - gap[0] <= 1e-6, words = known ? `gap ${shown(gap[1], "length")}` : `gap ${written(gap[0] / factor("length"))} to ${shown(gap[1], "length")} (${gapIs})`;
    pen.text(words, pen.width - 6, pen.height - 5, tone.limit, { align: "right" });
  }
  const f = factor("length"), ten = f * 10 ** Math.floor(Math.log10(reach / f || 1)), step = ten * [5, 2, 1].find((one) => one * ten <= reach || one === 1);
  for (const value of [-step, step]) {
    const [x] = at(value, 0), [, y] = at(0, value), words = written(value / f, 2);
    pen.line([[x, cy - 3], [x, cy + 3]], tone.muted);
    pen.line([[cx - 4, y], [cx, y]], tone.muted);
    pen.text(words, x, cy + 14, tone.muted, { size: 10, align: "center", halo: tone.back });
    pen.text(words, cx + 6, y + 3, tone.muted, { size: 10, halo: tone.back });
  }
  pen.text(unit("length"), 6, pen.height - 5, tone.muted, { size: 10 });
}
