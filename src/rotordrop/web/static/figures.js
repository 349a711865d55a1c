// What is drawn by hand: strokes on a canvas, in the colours of the page.

export function colours() {
  const style = getComputedStyle(document.documentElement);
  const names = ["ink", "muted", "line", "back", "panel", "measured", "estimated", "limit", "place0",
    "place1", "place2", "place3", "accent"];
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
    circle(x, y, radius, stroke, size = 1, fill = null, dash = []) {
      c.beginPath(); c.arc(x, y, Math.max(radius, 0), 0, 2 * Math.PI); c.setLineDash(dash);
      if (fill) { c.fillStyle = fill; c.fill(); }
      if (stroke) { c.lineWidth = size; c.strokeStyle = stroke; c.stroke(); }
    },
    text(words, x, y, colour, { align = "left", size = 11, weight = "", turned = false, halo = "" } = {}) {
      c.save(); c.translate(x, y);
      if (turned) { c.rotate(-Math.PI / 2); }
      c.font = `${weight} ${size}px system-ui, sans-serif`; c.textAlign = align; c.fillStyle = colour;
      if (halo) { c.lineWidth = 4; c.lineJoin = "round"; c.strokeStyle = halo; c.strokeText(words, 0, 0); }
      c.fillText(words, 0, 0); c.restore();
    }
  };
}

export function arrow(pen, [x0, y0], [x1, y1], colour, size = 2) {
  const angle = Math.atan2(y1 - y0, x1 - x0), length = Math.hypot(x1 - x0, y1 - y0);
  const head = Math.min(9, 0.5 * length);
  pen.line([[x0, y0], [x1 - 0.7 * head * Math.cos(angle), y1 - 0.7 * head * Math.sin(angle)]], colour, size);
  pen.area([0, 2.6, -2.6].map((turn) => (turn
    ? [x1 + head * Math.cos(angle + turn), y1 + head * Math.sin(angle + turn)] : [x1, y1])), colour);
}

export function keep(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
