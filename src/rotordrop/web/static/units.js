// Numbers for the axes and the readout. What is stated as a result comes written from the server.
let system = localStorage.getItem("rotordrop units") || "SI";
let known = {};

export const chosen = () => system;
export function choose(name) { system = name; localStorage.setItem("rotordrop units", name); }
export function learn(units) { known = { ...known, ...units }; }

export const factor = (kind) => (known[kind] ? known[kind][system][0] : 1);
export const unit = (kind) => (known[kind] ? known[kind][system][1] : "");

export function written(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) { return "–"; }
  const magnitude = value === 0 ? 0 : Math.floor(Math.log10(Math.abs(value)));
  const places = Math.max(0, digits - 1 - magnitude);
  const text = value.toFixed(Math.min(places, 6)).replace("-", "−");
  const [whole, rest] = text.split(".");
  const grouped = whole.replace(/\B(?=(\d{3})+$)/g, "\u202f");
  return rest ? `${grouped}.${rest}` : grouped;
}
export const shown = (value, kind, digits) => (Number.isFinite(value) ? `${written(value / factor(kind), digits)} ${unit(kind)}` : "–");

// Time from power-off: milliseconds in short windows, seconds in long ones.
export const timeScale = (span) => (span > 3 ? [1, "s"] : [1e-3, "ms"]);
export const eventText = (t) => (Math.abs(t) < 1 ? `${(1e3 * t).toFixed(2)} ms` : `${t.toFixed(4)} s`).replace("-", "−");
export function timeText(t, span) {
  const [scale, name] = timeScale(span);
  const places = Math.max(0, 3 - Math.floor(Math.log10(span / scale)));
  return `${(t / scale).toFixed(Math.min(places, 6)).replace("-", "−")} ${name}`;
}
