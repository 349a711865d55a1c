// The list of drops: what each is, in one row; sorted and filtered.
import * as address from "./address.js";
import * as server from "./server.js";
import { by, refused, say, tried } from "./state.js";
import { BADGES, make, quantity } from "./tables.js";
import * as units from "./units.js";

const home = { jobs: [], told: "", waiting: 0, open: false, sort: "date", down: true };
const VERBS = { estimate: "estimating", waterfall: "waterfall", check: "machine", look: "looking", channels: "reading" };

export const running = (job) => Object.keys(VERBS).find((verb) => ["waiting", "running"].includes(job.states[verb]?.state));
function stateOf(job) {
  const verb = running(job), { look, estimate } = job.states;
  if (job.damaged || job.row?.damaged) { return ["damaged", "bad"]; }
  if (verb) { const { state, fraction } = job.states[verb]; return [state === "waiting" ? "waiting" : `${VERBS[verb]} ${fraction > 0 ? `${Math.round(100 * fraction)} %` : "…"}`, "notice"]; }
  if (estimate?.result) { return ["estimated", ""]; }
  if (look?.state === "failed") { return ["not readable", "bad"]; }
  if (estimate?.state === "failed") { return ["estimate failed", "bad"]; }
  return [estimate?.state === "cancelled" ? "cancelled" : look?.result ? (job.row?.falls === false ? "no drop" : "looked at") : "files only", ""];
}
// Why a drop needs a person, as `watch` judged its latest result by the limits of the owner.
export const judged = ({ states, judged: told }) => (Object.values(states).some(({ result }) => result && result === told?.run) ? told.text : "");
// What is said of a drop in the list: that it is damaged or cannot be read, or the verdict of its estimate.
function statementOf(job) {
  const error = job.damaged || job.row?.damaged || (job.states.look?.state === "failed" ? job.states.look.error : "");
  if (!error && job.row?.statement?.level !== "bad" && judged(job)) { return { text: judged(job), level: "warning" }; }
  return error ? { text: error, level: "bad" } : job.row?.verb === "estimate" || job.row?.statement?.level === "bad" ? job.row.statement : null;
}

const dated = (job) => job.row?.recorded || new Date(1e3 * job.created).toISOString(); // of the event, else when it was added
const COLUMNS = [["name", "drop", (job) => job.name.toLowerCase()], ["machine", "machine", (job) => (job.row?.machine || "").toLowerCase()],
  ["date", "date", dated], ["speed", "speed", (job) => job.row?.speed?.value ?? -1], ["state", "state", (job) => stateOf(job)[0]],
  ["force", "peak force, 90\u00a0%", (job) => job.row?.force?.value ?? -1], ["stress", "peak stress, 90\u00a0%", (job) => job.row?.stress?.value ?? -1], ["verdict", "verdict", (job) => statementOf(job)?.level || ""]];
const NUMBERS = ["speed", "force", "stress"], WIDE = ["machine", "state"];

function shownJobs() {
  const words = by("query").value.toLowerCase().split(/\s+/).filter(Boolean), [, , key] = COLUMNS.find(([name]) => name === home.sort);
  const text = (job) => [job.name, job.row?.machine, dated(job), statementOf(job)?.text, stateOf(job)[0]].join(" ").toLowerCase();
  return home.jobs.filter((job) => words.every((word) => text(job).includes(word)))
    .sort((a, b) => (home.down ? -1 : 1) * (key(a) < key(b) ? -1 : key(a) > key(b) ? 1 : a.created - b.created));
}

export function askRemoval(job) {
  const sure = by("sure");
  sure.returnValue = ""; // a dialog keeps its last answer when it is left by Escape
  sure.showModal();
  sure.onclose = () => { if (sure.returnValue === "remove") { sure.returnValue = ""; tried(server.remove(job.id).then(() => address.go({ view: "drops" }))); } };
}

// An interval on the scale of all drops, so that the list by date is their log.
function drawnInterval({ interval_90: ends }, name) {
  const [low, high] = ends || [], most = Math.max(...home.jobs.map((job) => job.row?.[name]?.interval_90?.[1] || 0)), bar = make("span", { class: "drawn", of: [make("i")] });
  if (!ends) { return []; }
  Object.assign(bar.firstChild.style, { left: `${(100 * low) / most}%`, width: `${(100 * (high - low)) / most}%` });
  return [bar];
}

function row(job) {
  const [words, level] = stateOf(job), found = job.row, told = statementOf(job), open = () => address.go({ drop: job.id });
  const number = (one, name) => make("td", { class: "number", of: one ? [...quantity(one), make("span", { class: "interval", text: one.bearing }), ...drawnInterval(one, name)] : [make("span", { text: "–" })] });
  return make("tr", { on: { click: (event) => { if (!event.target.closest("a, button")) { open(); } } }, of: [
    make("th", { scope: "row", of: [make("a", { class: "dropname", href: address.of({ drop: job.id }), text: job.name }), ...(found?.simulated ? [make("span", { class: "tag", text: "simulated" })] : []),
      make("span", { class: "small narrow", text: [found?.machine, words].filter(Boolean).join(", ") })] }),
    make("td", { class: "wide", text: found?.machine || "–" }), make("td", { class: found?.recorded ? null : "small", text: `${found?.recorded ? "" : "added "}${units.minuteText(dated(job))}` }),
    make("td", { class: "number", text: found?.speed ? found.speed[units.chosen()][0] : "–" }), make("td", { class: `wide state ${level}`, text: words }), number(found?.force, "force"), number(found?.stress, "stress"),
    make("td", { class: "verdictcell", of: told ? [make("span", { class: `badge ${told.level}`, title: told.text, text: BADGES[told.level] }), ...(told.level === "good" ? [] : [make("span", { class: "small clamp", text: told.text })])] : [] }),
    make("td", { of: [make("button", { class: "link", text: "✕", title: "Remove …", "aria-label": `Remove ${job.name}`, on: { click: () => askRemoval(job) } })] })
  ] });
}

function draw() {
  if (!home.open) { return; }
  const rows = shownJobs(), focused = document.activeElement?.id;
  by("empty").hidden = home.jobs.length > 0;
  by("list").hidden = !home.jobs.length;
  by("drophead").replaceChildren(make("tr", { of: [...COLUMNS.map(([key, text]) => make("th", { scope: "col", class: NUMBERS.includes(key) ? "number" : WIDE.includes(key) ? "wide" : null, "aria-sort": key === home.sort ? (home.down ? "descending" : "ascending") : null,
    of: [make("button", { class: "link", id: `sort-${key}`, text: `${text}${key === home.sort ? (home.down ? " ▾" : " ▴") : ""}`, on: { click: () => sortBy(key) } })] })), make("th", { scope: "col", of: [make("span", { class: "hidden", text: "remove" })] })] }));
  by("droprows").replaceChildren(...(rows.length ? rows.map(row) : [make("tr", { of: [make("td", { colspan: COLUMNS.length + 1, text: `No drop has ${by("query").value.trim()} in its name, machine, date, state or verdict.` })] })]));
  by("count").textContent = rows.length === home.jobs.length ? `${rows.length} ${rows.length === 1 ? "drop" : "drops"}` : `${rows.length} of ${home.jobs.length} drops`;
  if (focused && document.activeElement === document.body) { by(focused)?.focus(); }
}

function sortBy(key) {
  Object.assign(home, { down: home.sort === key ? !home.down : ["date", ...NUMBERS].includes(key), sort: key });
  noted();
  draw();
}
const noted = () => address.note(() => ({ view: "drops", q: by("query").value.trim(), sort: home.sort === "date" && home.down ? "" : `${home.down ? "-" : ""}${home.sort}` }));

// What is in the folder; asked again as long as the list is seen, for others put drops there too.
async function load() {
  clearTimeout(home.waiting);
  const asked = performance.now();
  home.jobs = await server.jobs();
  if (!home.open) { return; }
  const told = JSON.stringify([home.jobs.map((job) => [job, running(job) ? job.states : ""]), units.chosen()]);
  if (told !== home.told && !document.querySelector("dialog[open]")) { home.told = told; draw(); }
  const busy = home.jobs.some((job) => running(job));
  if (!by("status").textContent) { say(home.jobs.length ? "A click on a row opens a drop." : "No drop yet.", "notice"); }
  const pause = Math.max(document.hidden ? 10000 : busy ? 1000 : 4000, 15 * (performance.now() - asked)); // hundreds of drops take a second
  home.waiting = setTimeout(() => { if (home.open) { load().catch(lost); } }, pause);
}
const lost = (error) => { if (refused(error)) { home.waiting = setTimeout(() => home.open && load().catch(lost), 1500); } };

export async function showHome(told) {
  const sort = (told.sort || "-date").replace(/^-/, "");
  Object.assign(home, { open: true, told: "", sort: COLUMNS.some(([key]) => key === sort) ? sort : "date", down: (told.sort || "-").startsWith("-") });
  by("query").value = told.q || "";
  by("home").hidden = false;
  by("status").replaceChildren();
  await load().catch(lost);
}
export function leaveHome() {
  home.open = false;
  clearTimeout(home.waiting);
  by("home").hidden = true;
}
export const redrawHome = draw;

by("query").addEventListener("input", () => { noted(); draw(); });
