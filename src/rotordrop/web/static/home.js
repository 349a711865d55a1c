// The list of drops: what each is, in one row; sorted, filtered, named, compared, logged.
import * as address from "./address.js";
import { isOpen, menu } from "./menu.js";
import * as server from "./server.js";
import { by, say, tried } from "./state.js";
import { BADGES, make } from "./tables.js";
import * as units from "./units.js";

const MOST_COMPARED = 4;
const home = { jobs: [], log: null, told: "", waiting: 0, open: false, chosen: new Set(), sort: "added", down: true };

export const label = (job) => ({ note: "", tags: [], notes: [], bearings: "", archived: false, ...job.label });
export const logged = (job, log = home.log) => (job.row && log ? log.drops.find((one) => one.sha256 === job.row.sha256) : undefined);
const speedOf = (row) => row?.speed?.[units.chosen()][0] || "–";

// The largest of a kind over the bearings, by the upper end of its interval.
export const worst = (row, field) => (row?.numbers || []).filter((one) => one.field === field).sort((a, b) => b.upper - a.upper)[0];
export const numberCell = (one) => make("td", { class: "number", of: one ? [make("span", { class: "value", text: one[units.chosen()][0] }),
  make("span", { class: "interval", text: [one[units.chosen()][1], one.bearing].filter(Boolean).join(", ") })] : [make("span", { text: "–" })] });

export function stateOf(job) {
  if (job.damaged) { return ["damaged", "bad"]; }
  const { look, estimate, waterfall, channels } = job.states, running = [estimate, waterfall, look, channels].find((one) => one && ["waiting", "running"].includes(one.state));
  if (running) {
    const verb = Object.keys(job.states).find((one) => job.states[one] === running);
    return running.state === "waiting" ? ["waiting", "notice"] : [`${{ estimate: "estimating", waterfall: "waterfall", look: "looking", channels: "reading" }[verb]} ${running.fraction > 0 ? `${Math.round(100 * running.fraction)} %` : "…"}`, "notice"];
  }
  if (job.row?.damaged) { return ["damaged", "bad"]; }
  if (estimate?.result) { return ["estimated", ""]; }
  if (look?.state === "failed") { return ["not readable", "bad"]; }
  if (estimate?.state === "failed") { return ["estimate failed", "bad"]; }
  return [estimate?.state === "cancelled" ? "cancelled" : look?.result ? "looked at" : "files only", ""];
}

const dated = (job) => job.row?.recorded || "";
const KEYS = {
  name: (job) => job.name.toLowerCase(), machine: (job) => (job.row?.machine || "").toLowerCase(), date: (job) => dated(job), added: (job) => job.created,
  speed: (job) => job.row?.speed?.value ?? -1, state: (job) => stateOf(job)[0], force: (job) => worst(job.row, "peak_force_N")?.upper ?? -1,
  stress: (job) => worst(job.row, "peak_stress_Pa")?.upper ?? -1, verdict: (job) => job.row?.statement?.level || ""
};
const COLUMNS = [["", ""], ["", "orbit"], ["name", "drop"], ["machine", "machine"], ["date", "date of event"], ["speed", "speed"], ["state", "state"],
  ["force", "peak force, 90 %"], ["stress", "peak stress, 90 %"], ["verdict", "verdict"], ["", "log"], ["", ""]];
const NUMBERS = ["speed", "force", "stress"];

function shownJobs() {
  const words = by("query").value.toLowerCase().split(/\s+/).filter(Boolean), which = by("which").value, key = KEYS[home.sort];
  const text = (job) => [job.name, job.row?.machine, dated(job), job.row?.statement?.text, stateOf(job)[0], label(job).note, ...label(job).tags, logged(job) ? "logged" : ""].join(" ").toLowerCase();
  return home.jobs.filter((job) => (which === "all" || label(job).archived === (which === "archived")) && words.every((word) => text(job).includes(word)))
    .sort((a, b) => (home.down ? -1 : 1) * (key(a) < key(b) ? -1 : key(a) > key(b) ? 1 : a.created - b.created));
}

export function thumbnail(orbit, name) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const put = (kind, told) => { const part = document.createElementNS(svg.namespaceURI, kind); Object.entries(told).forEach(([key, value]) => part.setAttribute(key, value)); svg.append(part); };
  Object.entries({ class: "thumbnail", viewBox: "0 0 100 100", role: "img", "aria-label": orbit ? `Orbit of ${name}` : "no orbit" }).forEach(([key, value]) => svg.setAttribute(key, value));
  if (orbit?.gap) { put("circle", { cx: 50, cy: 50, r: orbit.gap, class: "gap" }); }
  if (orbit) { put("polyline", { points: orbit.path }); }
  return svg;
}

// ---- what a row does

async function say_of(job, order) {
  await server.label(job.id, order);
  await load();
}
export async function addToLog(job) {
  const { number, bearings } = await server.addToLog(job.id);
  say(`${job.name} was logged as drop ${number} of its machine, bearings ${bearings}.`, "good");
  await load(true);
}
export async function takeOut(job) {
  await server.takeOutOfLog(job.id);
  say(`${job.name} was taken out of the log.`, "notice");
  await load(true);
}
export function askRemoval(job) {
  by("sure").showModal();
  by("sure").onclose = () => {
    if (by("sure").returnValue === "remove") { tried(server.remove(job.id).then(() => { home.chosen.delete(job.id); address.go({ view: "drops" }); })); }
  };
}
export function askAbout(job, done = () => load(true)) {
  const now = label(job);
  by("aboutname").value = job.name;
  by("abouttags").value = now.tags.join(", ");
  by("aboutnote").value = now.note;
  by("aboutbearings").value = now.bearings;
  by("about").showModal();
  by("aboutname").select();
  by("about").onclose = () => {
    if (by("about").returnValue !== "keep") { return; }
    const tags = by("abouttags").value.split(",").map((one) => one.trim()).filter(Boolean);
    tried(server.label(job.id, { name: by("aboutname").value, tags, note: by("aboutnote").value, bearings: by("aboutbearings").value.trim() }).then(done));
  };
}

function row(job) {
  const { archived, note, tags } = label(job), [words, level] = stateOf(job), found = job.row, entry = logged(job), open = () => address.go({ drop: job.id });
  const damage = job.damaged || found?.damaged, statement = damage ? { text: damage, level: "bad" } : job.states?.look?.state === "failed" ? { text: job.states.look.error, level: "bad" } : found?.statement;
  const verdict = statement && (found?.verb === "estimate" || statement.level === "bad") ? [make("span", { class: `badge ${statement.level}`, title: statement.text, text: BADGES[statement.level] || statement.level }), ...(statement.level === "good" ? [] : [make("span", { class: "small clamp", text: statement.text })])] : [];
  const inLog = entry ? [make("a", { href: address.of({ view: "log", machine: entry.machine, bearings: entry.bearings }), text: `drop ${entry.log}`, title: `Bearings ${entry.bearings}` })]
    : found?.verb === "estimate" ? [make("button", { text: "Add", id: `log-${job.id}`, "aria-label": `Add ${job.name} to the log`, on: { click: () => tried(addToLog(job)) } })] : [];
  return make("tr", { class: archived ? "archived" : null, on: { click: (event) => { if (!event.target.closest("a, button, input, .menu")) { open(); } } }, of: [
    make("td", { of: [make("input", { type: "checkbox", id: `choose-${job.id}`, "aria-label": `Choose ${job.name}`, ...(home.chosen.has(job.id) ? { checked: "" } : {}), on: { change: (event) => { home.chosen[event.target.checked ? "add" : "delete"](job.id); buttons(); } } })] }),
    make("td", { of: [thumbnail(found?.orbit, job.name)] }),
    make("th", { scope: "row", of: [make("a", { class: "dropname", id: `open-${job.id}`, href: address.of({ drop: job.id }), text: job.name }), ...(found?.simulated ? [make("span", { class: "tag sim", text: "simulated" })] : []),
      ...tags.map((tag) => make("button", { class: "tag", text: tag, title: `Only drops with ${tag}`, on: { click: () => { by("query").value = tag; draw(); } } })),
      make("span", { class: "small narrow", text: [found?.machine, words].filter(Boolean).join(", ") }),
      ...(note ? [make("span", { class: "small clamp", text: note, title: note })] : [])] }),
    make("td", { class: "wide", text: found?.machine || "–" }),
    make("td", { of: dated(job) ? [make("span", { text: units.minuteText(dated(job)) })] : [make("span", { class: "small", text: `added ${units.dateText(job.created)}` })] }),
    make("td", { class: "number", text: speedOf(found) }),
    make("td", { class: `wide state ${level}`, text: words }),
    numberCell(worst(found, "peak_force_N")), numberCell(worst(found, "peak_stress_Pa")),
    make("td", { class: "verdictcell", of: verdict }), make("td", { class: "state", of: inLog }),
    make("td", { of: [menu("⋯", `More of ${job.name}`, [["Open", open], ["Name and note …", () => askAbout(job)], [archived ? "Bring back" : "Archive", () => tried(say_of(job, { archived: !archived }))],
      ...(entry ? [["Take out of the log", () => tried(takeOut(job))]] : []), ["Remove …", () => askRemoval(job)]].filter(([text]) => !job.damaged || text.startsWith("Remove")))] })
  ] });
}

function buttons() {
  const there = [...home.chosen].filter((id) => home.jobs.some((job) => job.id === id && job.row));
  by("comparechosen").disabled = there.length < 2 || there.length > MOST_COMPARED;
  by("comparechosen").textContent = there.length ? `Compare ${there.length}` : "Compare";
  by("archivechosen").disabled = !home.chosen.size;
  by("choosewhy").textContent = !home.chosen.size ? "choose drops by their boxes" : by("comparechosen").disabled ? `to compare: 2 to ${MOST_COMPARED} that were looked at` : "";
  by("archivechosen").textContent = by("which").value === "archived" ? "Bring back" : "Archive";
}

function draw() {
  if (!home.open) { return; }
  const rows = shownJobs(), focused = document.activeElement?.id;
  by("empty").hidden = home.jobs.length > 0;
  by("list").hidden = !home.jobs.length;
  by("drophead").replaceChildren(make("tr", { of: COLUMNS.map(([key, text]) => make("th", { scope: "col", class: NUMBERS.includes(key) ? "number" : ["machine", "state"].includes(key) ? "wide" : null, "aria-sort": key && key === home.sort ? (home.down ? "descending" : "ascending") : null,
    of: key ? [make("button", { class: "link", id: `sort-${key}`, text: `${text}${key === home.sort ? (home.down ? " ▾" : " ▴") : ""}`, on: { click: () => sortBy(key) } })] : [make("span", { class: text ? null : "hidden", text: text || "choose" })] })) }));
  by("droprows").replaceChildren(...rows.map(row));
  by("count").textContent = rows.length === home.jobs.length ? `${rows.length} ${rows.length === 1 ? "drop" : "drops"}` : `${rows.length} of ${home.jobs.length} drops`;
  buttons();
  if (focused && document.activeElement === document.body) { by(focused)?.focus(); }
}

function sortBy(key) {
  Object.assign(home, { down: home.sort === key ? !home.down : ["date", "force", "stress", "speed"].includes(key), sort: key });
  noted();
  draw();
}
const noted = () => address.note(() => ({ view: "drops", q: by("query").value.trim(), which: by("which").value === "kept" ? "" : by("which").value, sort: home.sort === "added" ? "" : `${home.down ? "-" : ""}${home.sort}` }));

// What is in the folder; asked again as long as the list is seen, for others put drops there too.
async function load(logToo = false) {
  clearTimeout(home.waiting);
  const asked = performance.now();
  const [{ jobs, used, quota }, log] = await Promise.all([server.jobs(), logToo || !home.log ? server.log() : home.log]);
  const told = JSON.stringify([jobs, log, units.chosen()]);
  Object.assign(home, { jobs: jobs.filter((job) => job.damaged || job.files.record || !job.files.machine), log }); // a machine alone is no drop
  if (!home.open) { return; }
  if (told !== home.told && !isOpen() && !document.querySelector("dialog[open]")) { home.told = told; draw(); }
  const running = jobs.filter((job) => stateOf(job)[1] === "notice").length;
  if (log.problem) { say(log.problem, "bad"); } else if (!by("status").textContent) { say(jobs.length ? `${(used / 1e9).toFixed(2)} of ${(quota / 1e9).toFixed(1)} GB are used in the folder of the page.` : "No drop yet.", "notice"); }
  const pause = Math.max(document.hidden ? 10000 : running ? 1000 : 4000, 15 * (performance.now() - asked)); // hundreds of drops take a second
  home.waiting = setTimeout(() => { if (home.open) { load().catch(lost); } }, pause);
}
function lost(error) {
  say(error instanceof server.Refusal ? error.message : "The server does not answer; is 'rotordrop serve' running? The page tries again.", "bad");
  if (!(error instanceof server.Refusal)) { home.waiting = setTimeout(() => home.open && load(true).catch(lost), 1500); }
}

export async function showHome(told) {
  const sort = (told.sort || "-added").replace(/^-/, "");
  Object.assign(home, { open: true, told: "", sort: sort in KEYS ? sort : "added", down: (told.sort || "-").startsWith("-") });
  by("query").value = told.q || "";
  by("which").value = ["archived", "all"].includes(told.which) ? told.which : "kept";
  by("home").hidden = false;
  by("status").replaceChildren();
  await load(true).catch(lost);
}
export function leaveHome() {
  home.open = false;
  clearTimeout(home.waiting);
  by("home").hidden = true;
}
export const redrawHome = () => { home.told = ""; draw(); };

by("query").addEventListener("input", () => { noted(); draw(); });
by("which").addEventListener("change", () => { home.chosen.clear(); noted(); draw(); });
by("comparechosen").addEventListener("click", () => {
  const [first, ...others] = shownJobs().map((job) => job.id).filter((id) => home.chosen.has(id));
  address.go({ drop: first, tab: "Compare", with: others.join(",") });
});
by("archivechosen").addEventListener("click", () => tried(Promise.all([...home.chosen].map((id) => server.label(id, { archived: by("which").value !== "archived" }))).then(() => { home.chosen.clear(); return load(); })));
