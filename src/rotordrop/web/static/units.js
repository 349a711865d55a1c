// Numbers for the axes and the readout. What is stated as a result comes written from the server.
let system = localStorage.getItem("rotordrop units") || "SI";
let known = {};

export const chosen = () => system;
export function choose(name) { system = name; localStorage.setItem("rotordrop units", name); }
export function learn(units) { known = { ...known, ...units }; }

export const factor = (kind) => (known[kind] ? known[kind][system][0] : 1);
export const unit = (kind) => (known[kind] ? known[kind][system][1] : "");

// A minus sign that reads as one, and none before a zero.
export function fixed(value, places) {
  const text = value.toFixed(places);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

export function written(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) { return "–"; }
  const magnitude = value === 0 ? 0 : Math.floor(Math.log10(Math.abs(value)));
  const places = Math.max(0, digits - 1 - magnitude);
  const text = fixed(value, Math.min(places, 6));
  const [whole, rest] = text.split(".");
  const grouped = whole.replace(/\B(?=(\d{3})+$)/g, "\u202f");
  return rest ? `${grouped}.${rest}` : grouped;
}
export const shown = (value, kind, digits) => (Number.isFinite(value) ? `${written(value / factor(kind), digits)} ${unit(kind)}` : "–");

// Time from power-off: milliseconds in short windows, seconds in long ones.
export const timeScale = (span) => (span > 3 ? [1, "s"] : [1e-3, "ms"]);
export const eventText = (t) => (Math.abs(t) < 1 ? `${fixed(1e3 * t, 2)} ms` : `${fixed(t, 4)} s`);
export const minuteText = (date) => (/^\d{4}-\d\d-\d\dT\d\d:\d\d/.test(date) ? date.slice(0, 16).replace("T", " ").replaceAll("-", "\u2011") : date);
export function timeText(t, span) {
  const [scale, name] = timeScale(span);
  const places = Math.max(0, 3 - Math.floor(Math.log10(span / scale)));
  return `${fixed(t / scale, Math.min(places, 6))} ${name}`;
}
