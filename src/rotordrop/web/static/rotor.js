// The rotor to scale, with what sits on it, as the report draws it.
import { canvasPen, colours, keep, keepPng, keepSvg, svgPen, ticks } from "./figures.js";
import { fileName, files, showLines, state } from "./state.js";
import { make } from "./tables.js";

const KINDS = { "touchdown bearing": ["▲", "ink"], AMB: ["■", "accent"], sensor: ["▼", "place2"] };

function drawRotor(pen, rotor) {
  const tone = colours(), left = 14, right = pen.width - 14, scale = (right - left) / rotor.length;
  const cy = pen.height / 2 - 8, tall = Math.min(scale, (pen.height / 2 - 46) / (1.3 * rotor.top)), px = (z) => left + scale * z;
  const pieces = (list, fill) => list.forEach(([from, to, inner, outer]) => [1, -1].forEach((side) => {
    const box = [[px(from), cy - side * tall * inner], [px(to), cy - side * tall * inner], [px(to), cy - side * tall * outer], [px(from), cy - side * tall * outer]];
    pen.area(box, fill);
    pen.line([...box, box[0]], tone.muted, 0.7);
  }));
  pieces(rotor.layers, tone.line);
  pieces(rotor.shaft, tone.back);
  pen.line([[px(0), cy], [px(rotor.length), cy]], tone.muted, 0.8, [10, 3, 2, 3]);
  for (const { position } of rotor.discs) { pen.line([[px(position), cy - 0.85 * tall * rotor.top], [px(position), cy + 0.85 * tall * rotor.top]], tone.residual, 4); }
  const named = new Map();
  for (const { kind, name, position, height } of rotor.marks) {
    const [sign, colour] = KINDS[kind], at = `${kind} ${position}`;
    named.set(at, [...(named.get(at) || []), name]);
    if (named.get(at).length > 1) { continue; }
    pen.text(sign, px(position), cy - tall * height + (height > 0 ? -2 : 12), tone[colour], { align: "center", size: 13 });
  }
  for (const [at, names] of named) {
    const mark = rotor.marks.find((one) => `${one.kind} ${one.position}` === at);
    if (mark.kind !== "AMB") { pen.text(names.join(", "), px(mark.position), cy - tall * mark.height + (mark.height > 0 ? -16 : 26), tone.ink, { align: "center", size: 10 }); }
  }
  for (const z of ticks(0, rotor.length * 1e3, 6)) {
    pen.line([[px(z / 1e3), pen.height - 30], [px(z / 1e3), pen.height - 26]], tone.muted);
    pen.text(String(z), px(z / 1e3), pen.height - 15, tone.ink, { align: "center", size: 10 });
  }
  pen.text("position from node 1 [mm]; ▲ touchdown bearing, ■ AMB, ▼ sensor, bar: disc or point mass", pen.width / 2, pen.height - 2, tone.muted, { align: "center", size: 10 });
}

const picture = (rotor) => {
  const pen = svgPen(900, 300, colours().back, "Rotor");
  drawRotor(pen, rotor);
  return pen;
};
const table = (rotor) => ["kind,name,node,position [m]", ...[...rotor.discs.map((disc) => ({ kind: "disc", ...disc })), ...rotor.marks]
  .map(({ kind, name, node, position }) => [kind, JSON.stringify(name), node, position].join(",")), ""].join("\n");

export function rotorTab() {
  const page = state.estimate || state.look, { rotor } = page;
  if (!rotor) { return [make("p", { text: "The machine file describes the rotor; drop one on the page, or make one of twelve numbers." })]; }
  const words = rotor.marks.map(({ kind, name, position }) => `${kind} ${name} at ${Math.round(1e3 * position)} mm`).join(", ");
  const canvas = make("canvas", { class: "rotor", role: "img", "aria-label": `Rotor of ${Math.round(1e3 * rotor.length)} mm: ${words}` });
  requestAnimationFrame(() => { if (canvas.isConnected) { drawRotor(canvasPen(canvas), rotor); } });
  return [make("figure", { of: [canvas, make("header", { class: "right", of: [files("Rotor", {
    csv: () => keep(new Blob([table(rotor)], { type: "text/csv" }), `${fileName("rotor")}.csv`), svg: () => keepSvg(picture(rotor), fileName("rotor")),
    png: () => keepPng(picture(rotor), fileName("rotor")), python: () => showLines(page.python.rotor)
  })] })] })];
}
