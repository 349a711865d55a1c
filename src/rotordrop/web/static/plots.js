// Time traces that share one window and one cursor; overview strip above them.
import { canvasPen, colours, faint, levelColour, placeColour } from "./figures.js";
import { factor, timeScale, unit, written } from "./units.js";

const plots = [];
let following = false;

const values = (digits) => (u, splits) => splits.map((v) => (v === null ? "" : String(Number(v.toPrecision(digits))).replace("-", "−")));

function levelsOn(u, levels) {
  const c = u.ctx, ratio = window.devicePixelRatio || 1, tone = colours();
  c.save();
  c.beginPath(); c.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height); c.clip();
  c.lineWidth = ratio; c.setLineDash([5 * ratio, 4 * ratio]);
  for (const { value, place } of levels) {
    const y = u.valToPos(value, "y", true);
    c.strokeStyle = levelColour(tone, place);
    c.beginPath(); c.moveTo(u.bbox.left, y); c.lineTo(u.bbox.left + u.bbox.width, y); c.stroke();
  }
  c.restore();
}

// The mark of the second cursor, over every trace.
function markOn(u, mark, scale) {
  if (mark === null) { return; }
  const c = u.ctx, x = u.valToPos(mark / scale, "x", true);
  c.save();
  c.beginPath(); c.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height); c.clip();
  c.strokeStyle = colours().accent; c.setLineDash([6, 3]); c.lineWidth = 1.5 * (window.devicePixelRatio || 1);
  c.beginPath(); c.moveTo(x, u.bbox.top); c.lineTo(x, u.bbox.top + u.bbox.height); c.stroke();
  c.restore();
}

// A panel: {element, kind, axis, curves: [{label, colour, values, lower, upper}], levels, time, fromZero}
export function drawPanel(panel, view, on) {
  const tone = colours(), [scale, timeName] = timeScale(view.to - view.from), f = factor(panel.kind);
  const data = [Float64Array.from(panel.time, (t) => t / scale)], series = [{}], bands = [];
  const finite = (array) => Array.from(array, (v) => (Number.isFinite(v) ? v / f : null));
  const add = (array, made) => { data.push(finite(array)); series.push(made); };
  for (const { label, colour, values: drawn, lower, upper, width, dash } of panel.curves) {
    if (lower) {
      bands.push({ series: [series.length, series.length + 1], fill: faint(colour, 0.22) });
      const edge = { stroke: faint(colour, 0.35), width: 0.5, points: { show: false } };
      add(upper, { label: `${label}, upper`, ...edge }); add(lower, { label: `${label}, lower`, ...edge });
    }
    add(drawn, { label, stroke: colour, width: width || 1.3, dash, points: { show: false } });
  }
  const axis = { stroke: tone.ink, grid: { stroke: tone.line, width: 1 }, ticks: { stroke: tone.line, width: 1 }, font: "11px system-ui, sans-serif", labelFont: "11px system-ui, sans-serif" };
  const levels = panel.levels.map((level) => ({ ...level, value: level.value / f }));
  const range = (u, low, high) => {
    if (low === null || low === undefined) { return [0, 1]; }
    const least = panel.fromZero ? 0 : low, room = 0.08 * (high - least || Math.abs(high) || 1);
    return [panel.fromZero ? 0 : least - room, high + room];
  };
  const options = {
    width: panel.element.clientWidth, height: panel.element.clientHeight, legend: { show: false },
    cursor: { sync: { key: "time" }, drag: { x: true, y: false, setScale: false }, y: false, points: { show: false } },
    scales: { x: { time: false, range: () => [view.from / scale, view.to / scale] }, y: { range } },
    padding: [8, 16, panel.lowest ? 0 : 4, 0],
    axes: [{ ...axis, size: panel.lowest ? 26 : 3, values: panel.lowest ? values(8) : () => [], gap: 2, ...(panel.lowest ? { label: `time from ${on.origin} [${timeName}]`, labelSize: 16, labelGap: 0 } : {}) },
      { ...axis, size: 54, values: values(8), label: `${panel.axis} [${unit(panel.kind)}]`, labelSize: 16, labelGap: 0, gap: 3 }],
    series, bands,
    hooks: {
      draw: [(u) => levelsOn(u, levels), (u) => markOn(u, on.mark, scale)],
      setSelect: [(u) => {
        if (u.select.width > 3) {
          on.window(scale * u.posToVal(u.select.left, "x"), scale * u.posToVal(u.select.left + u.select.width, "x"));
        }
        u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
      }],
      setCursor: [(u) => { if (!following && u.cursor.left >= 0 && u.cursor.event) { on.cursor(scale * u.posToVal(u.cursor.left, "x")); } }]
    }
  };
  panel.element.replaceChildren();
  const made = new uPlot(options, data, panel.element);
  made.over.addEventListener("dblclick", on.home);
  made.over.addEventListener("click", (event) => { if (event.shiftKey) { on.setMark(scale * made.posToVal(event.offsetX, "x")); } });
  made.over.addEventListener("wheel", (event) => {
    event.preventDefault();
    on.zoom(event.deltaY > 0 ? 1.25 : 0.8, scale * made.posToVal(event.offsetX, "x"));
  }, { passive: false });
  plots.push({ made, scale });
  const sums = panel.curves.map(({ label, values: drawn }) => {
    let high = -Infinity;
    for (const v of drawn) { if (v > high) { high = v; } }
    return `${label} up to ${written(high / f)} ${unit(panel.kind)}`;
  });
  made.root.setAttribute("role", "img");
  made.root.setAttribute("aria-label", `${panel.axis} against time: ${sums.join("; ")}`);
}

export function clearPlots() { plots.splice(0).forEach(({ made }) => made.destroy()); }

export function follow(cursor) {
  following = true;
  for (const { made, scale } of plots) {
    if (made.status === 1) { made.setCursor({ left: cursor === null ? -10 : made.valToPos(cursor / scale, "x"), top: 5 }, false); }
  }
  following = false;
}

// data: {time, curves: [{values}]}; events: [{time, words}]
export function drawOverview(canvas, { data, events, impacts, view, span, mark, origin }) {
  const pen = canvasPen(canvas);
  const tone = colours(), top = 4, bottom = pen.height - 16;
  const px = (t) => ((t - span[0]) / (span[1] - span[0])) * pen.width;
  let high = 0;
  for (const { values: drawn } of data.curves) { for (const v of drawn) { if (v > high) { high = v; } } }
  const py = (v) => bottom - (v / (1.05 * high || 1)) * (bottom - top);
  const left = px(view.from), right = Math.max(px(view.to), left + 2);
  pen.area([[left, top], [right, top], [right, bottom], [left, bottom]], faint(tone.accent, 0.18));
  data.curves.forEach(({ values: drawn }, i) => {
    pen.line(Array.from(data.time, (t, k) => [px(t), py(drawn[k])]), placeColour(tone, i), 1);
  });
  for (const t of impacts) { pen.line([[px(t), bottom], [px(t), bottom - 5]], tone.limit, 1); }
  for (const { time } of events) { pen.line([[px(time), top], [px(time), bottom]], tone.muted, 1, [2, 3]); }
  if (mark !== null) { pen.line([[px(mark), top], [px(mark), bottom]], tone.accent, 1.5); }
  pen.line([[left, top], [left, bottom]], tone.accent, 1);
  pen.line([[right, top], [right, bottom]], tone.accent, 1);
  const [scale, name] = timeScale(span[1] - span[0]);
  pen.text(`${written(span[0] / scale, 3)} ${name}`, 2, pen.height - 3, tone.muted, { size: 10 });
  pen.text(`${written(span[1] / scale, 3)} ${name}`, pen.width - 2, pen.height - 3, tone.muted, { size: 10, align: "right" });
  pen.text(`time from ${origin}, radius in every plane`, pen.width / 2, pen.height - 3, tone.muted, { size: 10, align: "center" });
}
