// Machines: what the drops were dropped on, and what is computed of them alone, in the reports of the commands.
import * as address from "./address.js";
import { menu } from "./menu.js";
import { keep } from "./figures.js";
import * as server from "./server.js";
import { by, say, showLines, tried } from "./state.js";
import { make } from "./tables.js";
import * as units from "./units.js";

const STUDY = `name = "Friction"
drops = 100
speed = "60 Hz"
duration = "0.2 s"

[vary]
"*.friction.dynamic" = { uniform = [0.05, 0.2] }   # one value for all touchdown bearings
`;
const DESIGN = `name = "Supports"
speed = "60 Hz"
candidates = 8
rounds = 1
repeats = 4
again = 8
aims = [{ column = "*.peak_stress", quantile = 0.9 }]

[choose]
"*.support.stiffness" = { log_uniform = ["3e7 N/m", "3e8 N/m"] }

[vary]
"*.friction.dynamic" = { uniform = [0.05, 0.25] }
`;
const TABS = { check: ["Machine", "Mass, load shares, frequencies, sag, assumptions, and what is doubtful."],
  speeds: ["Critical speeds", "Critical speeds on supports of any stiffness, and damped modes against the speed."],
  unbalance: ["Unbalance response", "Amplitude and phase under unbalance over the speed, with amplification factors and margins."],
  study: ["Study", "How force, stress and whirl of many simulated drops are spread. The plan says what varies.", STUDY],
  design: ["Design", "Values within bounds for the mildest drops. The plan says what is chosen, what varies and what is aimed at.", DESIGN] };
const view = { jobs: [], key: "", tab: "check", waiting: 0, open: false, shown: "", plans: {} };

const keyOf = ({ files }) => Object.entries(files).filter(([role]) => role === "machine" || role.startsWith("beside")).map(([, file]) => file.sha256.slice(0, 16)).sort().join("-");
function machines() {
  const found = new Map();
  for (const job of view.jobs.filter((one) => one.files?.machine)) { found.set(keyOf(job), [...(found.get(keyOf(job)) || []), job]); }
  return found;
}
const nameOf = (jobs) => jobs.find((job) => job.row?.machine)?.row.machine || jobs[0].files.machine.name;
const stateOf = (jobs, verb) => jobs.find((job) => ["waiting", "running"].includes(job.states[verb]?.state)) || jobs.find((job) => job.states[verb]?.result) || jobs.find((job) => job.states[verb]) || jobs[0];

function list() {
  const rows = [...machines()].map(([key, jobs]) => {
    const drops = jobs.filter((job) => job.files.record), last = drops.map((job) => job.row?.recorded || "").sort().at(-1), open = address.of({ view: "machine", machine: key });
    return make("tr", { on: { click: (event) => { if (!event.target.closest("a")) { location.hash = open; } } }, of: [make("th", { scope: "row", of: [make("a", { class: "dropname", href: open, text: nameOf(jobs) })] }),
      make("td", { text: jobs[0].files.machine.name }), make("td", { class: "number", text: String(drops.length) }), make("td", { text: last ? units.minuteText(last) : "–" }),
      make("td", { text: Object.keys(TABS).filter((verb) => jobs.some((job) => job.states[verb]?.result)).map((verb) => TABS[verb][0].toLowerCase()).join(", ") || "–" })] });
  });
  by("machines").replaceChildren(rows.length ? make("div", { class: "table", of: [make("table", { class: "drops", of: [make("caption", { class: "hidden", text: "Machines" }),
    make("thead", { of: [make("tr", { of: ["machine", "file", "drops", "last drop", "computed"].map((text, i) => make("th", { scope: "col", text, class: i === 2 ? "number" : null })) })] }), make("tbody", { id: "machinerows", of: rows })] })] })
    : make("p", { text: "No machine file yet. Drop one on the page, with its shaft table or a record where there is one." }));
  say(rows.length === 1 ? "1 machine." : `${rows.length} machines.`, "notice");
}

// ---- one machine

async function begin(job, verb) {
  const plan = by("plan")?.value;
  await server.begin(job.id, verb, plan === undefined ? {} : { plan });
  view.shown = "";
  await load();
}
async function body(jobs) {
  const verb = view.tab, [title, words, plan] = TABS[verb], job = stateOf(jobs, verb), told = job.states[verb], running = told && ["waiting", "running"].includes(told.state);
  const compute = make("button", { id: "computemachine", class: "main", text: told?.result ? "Compute again" : "Compute", on: { click: () => tried(begin(job, verb)) } });
  const field = plan && make("details", { ...(told?.result ? {} : { open: "" }), of: [make("summary", { text: "Plan" }), make("label", { class: "planfield", of: ["TOML, as in the documentation of studies; the machine is this one", make("textarea", { id: "plan", rows: 14, maxlength: 8000, spellcheck: "false" })] })] });
  if (field) { const area = field.querySelector("textarea"); area.value = view.plans[verb] ?? told?.options?.plan ?? plan; area.addEventListener("input", () => { view.plans[verb] = area.value; }); }
  if (running) {
    return [make("p", { of: [make("span", { text: `${title}: ${told.state === "waiting" ? "waiting for another computation" : "computing"} (${Math.round(told.spent)} s) ` }), make("progress", { "aria-label": title }), " ",
      make("button", { text: "Cancel", id: "cancelmachine", on: { click: () => tried(server.cancel(job.id, verb).then(() => load())) } })] })];
  }
  const failed = told?.state === "failed" ? [make("p", { class: "state bad", text: told.error })] : [];
  if (!told?.result) { return [make("p", { text: words }), ...failed, ...(field ? [field] : []), compute]; }
  const [page, source] = await Promise.all([server.page(job.id, verb), server.reportAddress(job.id, verb)]);
  const report = () => server.openReport(job.id, verb);
  const saved = Object.entries(page.files).map(([file, text]) => [`Save ${file}`, () => keep(new Blob([text], { type: "text/plain" }), file)]);
  return [make("div", { class: "tools", of: [compute, make("span", { class: "right" }), menu("⋯", `${title}: open, save, as Python`, [["Open the report", () => tried(report())], ["Save as JSON", async () => keep(new Blob([await server.documentText(job.id, verb)], { type: "application/json" }), `${verb}.json`)],
    ["As Python", () => showLines(page.python)], ["As command", () => showLines(page.command, "As command")], ...saved])] }), ...failed, ...(field ? [field] : []),
  make("iframe", { class: "reportframe", title, src: source, sandbox: "allow-scripts allow-downloads allow-modals" })];
}
async function one() {
  const jobs = machines().get(view.key), verb = view.tab;
  if (!jobs) { by("machines").replaceChildren(make("p", { text: "There is no such machine; its drops may have been removed." })); return; }
  const told = JSON.stringify([view.key, verb, jobs.map((job) => [job.id, { ...job.states[verb], spent: 0 }])]), seconds = stateOf(jobs, verb).states[verb]?.state === "running" ? Date.now() : 0;
  if (told + seconds === view.shown) { return; }
  view.shown = told + seconds;
  const made = await tried(body(jobs));
  if (!view.open || view.tab !== verb || !made) { return; }
  const tabs = Object.entries(TABS).map(([name, [text]]) => make("button", { role: "tab", id: `tab-${name}`, text, "aria-selected": String(name === verb), tabindex: name === verb ? "0" : "-1", "aria-controls": "machinepanel", on: { click: () => address.go({ view: "machine", machine: view.key, tab: name }) } }));
  const focused = document.activeElement?.id;
  by("machines").replaceChildren(make("h2", { class: "machinename", text: nameOf(jobs) }), make("div", { class: "tabs", role: "tablist", of: tabs }), make("div", { id: "machinepanel", role: "tabpanel", tabindex: "0", "aria-label": TABS[verb][0], of: made }));
  if (focused) { by(focused)?.focus(); }
  const kept = jobs.filter((job) => job.files.record).length;
  say(`${jobs[0].files.machine.name}; ${kept === 1 ? "1 drop of this machine is" : `${kept} drops of this machine are`} kept.`, "notice");
}

async function load() {
  clearTimeout(view.waiting);
  view.jobs = (await server.jobs()).jobs;
  if (!view.open) { return; }
  if (view.key) { await one(); } else { list(); }
  const busy = view.jobs.some((job) => Object.keys(TABS).some((verb) => ["waiting", "running"].includes(job.states?.[verb]?.state)));
  if (busy) { view.waiting = setTimeout(() => tried(load()), 1200); }
}
export async function showMachines(told) {
  Object.assign(view, { open: true, shown: "", key: told.view === "machine" ? told.machine || "" : "", tab: told.tab in TABS ? told.tab : "check" });
  by("machines").hidden = false;
  await load();
}
export function leaveMachines() {
  view.open = false;
  clearTimeout(view.waiting);
  by("machines").hidden = true;
}
by("machines").addEventListener("keydown", (event) => {
  if (!event.target.closest("[role=tablist]") || !/^Arrow(Left|Right)$/.test(event.key)) { return; }
  const names = Object.keys(TABS), step = event.key === "ArrowRight" ? 1 : names.length - 1, next = names[(names.indexOf(view.tab) + step) % names.length];
  event.stopPropagation();
  address.go({ view: "machine", machine: view.key, tab: next });
  by(`tab-${next}`)?.focus();
});
