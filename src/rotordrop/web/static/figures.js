// One drawing for screen and file: the same strokes go to a canvas or into an SVG.
const SVG = "http://www.w3.org/2000/svg";

export function colours() {
  const style = getComputedStyle(document.documentElement);
  const names = ["ink", "muted", "line", "back", "panel", "measured", "estimated", "residual", "limit", "place0",
    "place1", "place2", "place3", "band", "accent"];
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

export const levelColour = (tone, place) => (place === undefined ? tone.limit : placeColour(tone, place));
// The names of the levels for the head of a figure; those of several places share one.
export const levelKeys = (levels, tone) => [...new Map(levels.map((level) => [level.name, level])).values()].map(({ name, place }) => (
  { label: name, colour: place === undefined ? tone.limit : tone.muted, dash: [5, 4] }));
export const placeColour = (tone, index) => tone[`place${index % 4}`];
export const faint = (colour, share) => {
  const number = parseInt(colour.slice(1), 16);
  return `rgba(${number >> 16}, ${(number >> 8) & 255}, ${number & 255}, ${share})`;
};

export function canvasPen(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio)) { canvas.width = Math.round(width * ratio); }
  if (canvas.height !== Math.round(height * ratio)) { canvas.height = Math.round(height * ratio); }
  const c = canvas.getContext("2d");
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, width, height);
  return {
    width, height,
    line(points, colour, size = 1, dash = []) {
      c.beginPath();
      let down = false;
      for (const [x, y] of points) {
        if (!Number.isFinite(x) || !Number.isFinite(y)) { down = false; continue; }
        if (down) { c.lineTo(x, y); } else { c.moveTo(x, y); down = true; }
      }
      c.setLineDash(dash); c.lineWidth = size; c.strokeStyle = colour; c.lineJoin = "round"; c.stroke();
    },
    area(points, colour) {
      c.beginPath();
      points.forEach(([x, y], i) => (i ? c.lineTo(x, y) : c.moveTo(x, y)));
      c.closePath(); c.fillStyle = colour; c.fill();
    },
    image(source, x, y, wide, high) { c.imageSmoothingEnabled = false; c.drawImage(source, x, y, wide, high); },
    circle(x, y, radius, stroke, size = 1, fill = null, dash = []) {
      c.beginPath(); c.arc(x, y, Math.max(radius, 0), 0, 2 * Math.PI); c.setLineDash(dash);
      if (fill) { c.fillStyle = fill; c.fill(); }
      if (stroke) { c.lineWidth = size; c.strokeStyle = stroke; c.stroke(); }
    },
    text(words, x, y, colour, { align = "left", size = 11, weight = "", turned = false } = {}) {
      c.save(); c.translate(x, y);
      if (turned) { c.rotate(-Math.PI / 2); }
      c.font = `${weight} ${size}px system-ui, sans-serif`; c.textAlign = align; c.fillStyle = colour;
      c.fillText(words, 0, 0); c.restore();
    }
  };
}

canvasPen.size = (canvas) => ({ width: canvas.clientWidth, height: canvas.clientHeight });

export function svgPen(width, height, back, title) {
  const root = document.createElementNS(SVG, "svg");
  const put = (name, attributes, words) => {
    const element = document.createElementNS(SVG, name);
    Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
    if (words !== undefined) { element.textContent = words; }
    root.append(element);
  };
  Object.entries({ xmlns: SVG, width, height, viewBox: `0 0 ${width} ${height}` })
    .forEach(([key, value]) => root.setAttribute(key, value));
  put("title", {}, title);
  put("rect", { width, height, fill: back });
  const at = ([x, y]) => `${x.toFixed(2)},${y.toFixed(2)}`;
  const path = (points) => {
    let down = false, text = "";
    for (const point of points) {
      if (!point.every(Number.isFinite)) { down = false; continue; }
      text += (down ? "L" : "M") + at(point); down = true;
    }
    return text;
  };
  return {
    width, height,
    line: (points, colour, size = 1, dash = []) => put("path", {
      d: path(points), fill: "none", stroke: colour, "stroke-width": size, "stroke-dasharray": dash.join(" ")
    }),
    image: (source, x, y, width, height) => put("image", { href: source.toDataURL(), x, y, width, height, preserveAspectRatio: "none", style: "image-rendering: pixelated" }),
    area: (points, colour) => put("path", { d: `${path(points)}Z`, fill: colour }),
    circle: (x, y, radius, stroke, size = 1, fill = null, dash = []) => put("circle", {
      cx: x, cy: y, r: Math.max(radius, 0), stroke: stroke || "none", "stroke-width": size, fill: fill || "none",
      "stroke-dasharray": dash.join(" ")
    }),
    text: (words, x, y, colour, { align = "left", size = 11, weight = "", turned = false } = {}) => put("text", {
      x, y, fill: colour, "font-size": size, "font-family": "system-ui, sans-serif",
      "font-weight": weight || "normal",
      "text-anchor": { left: "start", center: "middle", right: "end" }[align],
      ...(turned ? { transform: `rotate(-90 ${x} ${y})` } : {})
    }, words),
    content: () => new XMLSerializer().serializeToString(root)
  };
}

export function arrow(pen, [x0, y0], [x1, y1], colour, size = 2) {
  const angle = Math.atan2(y1 - y0, x1 - x0), length = Math.hypot(x1 - x0, y1 - y0);
  const head = Math.min(9, 0.5 * length);
  pen.line([[x0, y0], [x1 - 0.7 * head * Math.cos(angle), y1 - 0.7 * head * Math.sin(angle)]], colour, size);
  pen.area([0, 2.6, -2.6].map((turn) => (turn
    ? [x1 + head * Math.cos(angle + turn), y1 + head * Math.sin(angle + turn)] : [x1, y1])), colour);
}

export function ticks(low, high, about = 5) {
  const raw = (high - low) / about, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw) || raw;
  const found = [];
  for (let value = Math.ceil(low / step) * step; value <= high + 1e-9 * step; value += step) { found.push(value); }
  return found.map((value) => Number(value.toPrecision(12)));
}

// A time trace as a picture of its own, with all labels: for SVG and PNG.
export function tracePicture(pen, { title, x, y, curves, bands, levels, uprights = [] }) {
  const tone = colours(), box = { left: 70, right: pen.width - 16, top: 44, bottom: pen.height - 46 };
  const px = (v) => box.left + ((v - x.low) / (x.high - x.low)) * (box.right - box.left);
  const py = (v) => box.bottom - ((v - y.low) / (y.high - y.low)) * (box.bottom - box.top);
  for (const v of ticks(x.low, x.high, 8)) {
    pen.line([[px(v), box.top], [px(v), box.bottom]], tone.line);
    pen.text(String(v).replace("-", "−"), px(v), box.bottom + 16, tone.ink, { align: "center" });
  }
  for (const v of ticks(y.low, y.high)) {
    pen.line([[box.left, py(v)], [box.right, py(v)]], tone.line);
    pen.text(String(v).replace("-", "−"), box.left - 6, py(v) + 4, tone.ink, { align: "right" });
  }
  const clip = (v) => Math.min(Math.max(v, y.low), y.high);
  for (const { time, lower, upper, colour } of bands) {
    const up = Array.from(time, (t, i) => [px(t), py(clip(upper[i]))]);
    const down = Array.from(time, (t, i) => [px(t), py(clip(lower[i]))]).reverse();
    pen.area([...up, ...down].filter((point) => point.every(Number.isFinite)), colour);
  }
  for (const { value, place } of levels.filter((one) => one.value >= y.low && one.value <= y.high)) {
    pen.line([[box.left, py(value)], [box.right, py(value)]], levelColour(tone, place), 1, [5, 4]);
  }
  for (const { time, values, colour, width = 1.3, dash = [] } of curves) {
    pen.line(Array.from(time, (t, i) => [px(t), py(clip(values[i]))]), colour, width, dash);
  }
  for (const { at, text, mark } of uprights.filter((one) => one.at >= x.low && one.at <= x.high)) {
    pen.line([[px(at), box.top], [px(at), box.bottom]], mark ? tone.accent : tone.residual, 1.2, mark ? [] : [3, 3]);
    pen.text(text, px(at) + 3, box.top + 11, mark ? tone.accent : tone.residual, { size: 10 });
  }
  pen.line([[box.left, box.top], [box.right, box.top], [box.right, box.bottom], [box.left, box.bottom], [box.left, box.top]],
    tone.muted);
  pen.text(title, box.left, 18, tone.ink, { size: 13, weight: "600" });
  let at = box.left;
  for (const { label, colour, dash = [] } of [...curves, ...levelKeys(levels, tone)]) {
    pen.line([[at, 33], [at + 26, 33]], colour, 2, dash);
    pen.text(label, at + 31, 37, tone.ink);
    at += 46 + 6.2 * label.length;
  }
  pen.text(x.label, 0.5 * (box.left + box.right), pen.height - 10, tone.ink, { align: "center", size: 12 });
  pen.text(y.label, 16, 0.5 * (box.top + box.bottom), tone.ink, { align: "center", size: 12, turned: true });
}

export function keep(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

export const keepSvg = (pen, name) => keep(new Blob([pen.content()], { type: "image/svg+xml" }), `${name}.svg`);

export function keepPng(pen, name) {
  const picture = new Image(), address = URL.createObjectURL(new Blob([pen.content()], { type: "image/svg+xml" }));
  picture.onload = () => {
    const canvas = document.createElement("canvas");
    canvas.width = 2 * pen.width; canvas.height = 2 * pen.height;
    canvas.getContext("2d").drawImage(picture, 0, 0, canvas.width, canvas.height);
    URL.revokeObjectURL(address);
    canvas.toBlob((blob) => keep(blob, `${name}.png`));
  };
  picture.src = address;
}
