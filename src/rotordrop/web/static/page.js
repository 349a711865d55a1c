// The page: one job, its figures, its reports and its status, and what every button and key does.
import * as address from "./address.js";
import { pan, play, setMark, setView, setWindow, stepCursor, zoom } from "./cursor.js";
import { keep } from "./figures.js";
import { askRemoval, judged, leaveHome, redrawHome, running, showHome } from "./home.js";
import { drawAll, loadView } from "./panels.js";
import { askChannels, chooseFiles, sendExample, tailPair, tellFormats, useTail } from "./sending.js";
import * as server from "./server.js";
import { by, events, homeView, impacts, origin, refused, samples, say, simulated, span, state, tried } from "./state.js";
import { impactTable, make, timeline } from "./tables.js";
import * as units from "./units.js";

function goImpact(index) {
  const list = impacts();
  if (!list.length) { return; }
  state.impact = Math.min(Math.max(index, 0), list.length - 1);
  const { time } = list[state.impact];
  state.cursor = time;
  setView({ from: time - 0.006, to: time + 0.012 });
  showTab("Impacts");
  by("tabpanel").querySelector(".here")?.scrollIntoView({ block: "nearest" });
}

// ---- what is written

const TABS = {
  Impacts: () => {
    const source = state.estimate && state.estimate.impacts.length ? state.estimate : state.look, list = impacts();
    if (!list.length) { return [make("p", { text: `No impacts: ${state.look.row.falls ? "no contact is seen after the release" : "nothing falls in this record"}.` })]; }
    return [impactTable(list, source.impact_columns, state.impact, units.eventText, goImpact), make("p", { class: "small", text: "Small beside a value: its 90 % interval." }),
      ...(source === state.estimate ? [make("p", { class: "small", text: "Every contact, the hardest first; the other contacts follow hops too short for an impact." })] : [])];
  },
  Events: () => [make("p", { class: "small", text: `Times count from ${origin()}${state.estimate ? "" : "; an interval beside an event is its own, on the clock of the record"}.` }),
    timeline(events(), units.eventText, (time) => { state.cursor = time; setView({ from: time - 0.05, to: time + 0.1 }); })]
};

const tabList = (box, names, chosen, choose, panel) => box.replaceChildren(...names.map(([name, text, more = {}]) => make("button", {
  role: "tab", text, "aria-selected": String(name === chosen), tabindex: name === chosen ? "0" : "-1", "aria-controls": panel, "data-name": name, ...more, on: { click: () => choose(name) }
})));
function showTab(name, focus = false) {
  state.tab = name;
  tabList(by("tabs"), Object.keys(TABS).map((text) => [text, text]), name, (text) => showTab(text, true), "tabpanel");
  if (focus) { by("tabs").querySelector('[aria-selected="true"]').focus(); }
  by("tabpanel").setAttribute("aria-label", name);
  by("tabpanel").replaceChildren(...TABS[name]());
  noted();
}

const STAGES = { look: "reading and checking the record", channels: "reading the record", check: "computing" };
const SAID = { channels: "Channels", look: "Looking", estimate: "Estimating", waterfall: "Waterfall", check: "Machine" };
function showStatus() {
  const { states, files, damaged } = state.job, { look, estimate } = states, busy = running(state.job);
  for (const id of ["estimate", "channels", "tomachine"]) { by(id).disabled = Boolean(damaged); }
  for (const [id, role] of [["savemachine", "machine"], ["saveprofile", "profile"]]) { by(id).hidden = !files[role]; }
  by("tomachine").hidden = Boolean(files.machine);
  by("document").hidden = !estimate?.result;
  showViews();
  if (damaged) { say(damaged, "bad", make("button", { text: "Remove", on: { click: () => askRemoval(state.job) } })); return false; }
  by("estimate").disabled = Boolean(busy) || !files.machine || !state.look;
  by("estimate").textContent = estimate?.result ? "Estimate again" : "Estimate";
  by("estimate").classList.toggle("main", !estimate?.result);
  by("why").textContent = busy ? "" : needed();
  by("simulated").hidden = !simulated();
  by("simulated").title = simulated();
  if (busy) {
    const told = states[busy], share = told.fraction || 0, stage = told.state === "waiting" ? "waiting for another computation" : told.stage || STAGES[busy] || "compiling and preparing";
    say(`${SAID[busy]}: ${stage} (${Math.round(told.spent)} s)`, "notice", make("progress", { max: 1, "aria-label": stage, ...(share > 0 ? { value: share } : {}) }),
      make("button", { text: "Cancel", id: "cancel", on: { click: async () => { state.job = await server.cancel(state.job.id, busy); await refresh(); } } }));
    return true;
  }
  const failed = [state.report, "estimate", "look"].find((verb) => states[verb]?.state === "failed");
  if (failed) { say(states[failed].error, "bad", ...(failed === "look" ? waysOut(states[failed].error) : [])); }
  else if (state.estimate) {
    const { text: said, level: grade } = state.estimate.statement, needs = judged(state.job);
    say(needs && grade === "good" ? `${said} ${needs}` : said, needs && grade === "good" ? "warning" : grade, ...state.estimate.headline.map(({ name, label, number }) => {
      const [text, interval] = number[units.chosen()];
      return make("span", { class: "headline", of: [make("span", { text: `${name} ${label} ` }), make("strong", { text }), make("span", { class: "note", text: interval ? ` (90 %: ${interval})` : "" })] });
    }));
  }
  else if (state.look) { say((estimate?.state === "cancelled" ? "The estimate was cancelled. " : "") + state.look.statement.text, state.look.statement.level, ...tailOffer()); }
  else { say("Nothing was found yet.", "notice"); }
  return false;
}

// A record of rest and a drop without a tail: what was sent apart belongs together.
function tailOffer() {
  if (!state.pair) { return []; }
  const [rest, drop] = state.pair, text = rest.id === state.job.id ? `Use as the settled tail of ${drop.name}` : `Use ${rest.name} as its settled tail`;
  return [make("button", { id: "usetail", text, on: { click: () => tried(useTail(rest, drop).then(sent)) } })];
}

// What helps after a record could not be looked at: the missing file, the channels, or to look once more.
function waysOut(error) {
  const missing = error.match(/shaft table '([^']+)'/);
  const again = async () => { state.job = await server.begin(state.job.id, "look", {}); await refresh(); };
  const way = (text, click) => make("button", { text, on: { click: () => Promise.resolve(click()).catch(lost) } });
  return [...(missing ? [way(`Choose ${missing[1]} …`, openFiles)] : [way("Channels …", () => channels(error))]), way("Look again", again), way("Remove", () => askRemoval(state.job))];
}

// A file that could not be read: what it begins with is the first thing that anybody looks at.
const TEXTS = /\.(csv|txt|dat|tsv|asc|prn|log|lvm|toml)$/i, LARGEST_SHOWN = 8e6, SHOWN_CHARACTERS = 6000, SHOWN_LINES = 30;
async function showUnread() {
  const { id, files: sent, states: { look } } = state.job, unread = look?.state === "failed" && !state.look;
  by("unread").hidden = !unread;
  if (!unread) { return; }
  const [role, file] = Object.entries(sent).find(([, one]) => look.error.startsWith(one.name)) || ["record", sent.record];
  const key = `${id} ${file?.sha256}`;
  if (!file || by("unread").dataset.of === key) { return; }
  by("unread").dataset.of = key;
  by("unread").replaceChildren(make("h3", { class: "part", text: `${file.name}, ${file.bytes} bytes` }));
  if (!TEXTS.test(file.name) || file.bytes > LARGEST_SHOWN) { return; }
  const bytes = await (await server.sentFile(id, role)).slice(0, SHOWN_CHARACTERS).arrayBuffer(), read = (encoding) => new TextDecoder(encoding).decode(bytes);
  const text = read("utf-8").slice(0, -1).includes("\ufffd") ? read("windows-1252") : read("utf-8"); // the cut may part a letter
  by("unread").append(make("p", { class: "small", text: "It begins with these lines:" }),
    make("ol", { class: "begins", of: text.split(/\r?\n/).slice(0, SHOWN_LINES).map((line) => make("li", { of: [make("code", { text: line })] })) }));
}

// ---- figures or a report: one is seen at a time

const REPORTS = { look: ["Look", "Report of the look"], estimate: ["Report", "Report of the estimate"], waterfall: ["Waterfall", "Frequencies of a coast-down (w)"], check: ["Machine", "What the machine amounts to"] };
const needed = (verb) => (verb !== "check" && !state.look ? "needs a readable record" : state.job.files.machine ? "" : "needs the machine file");
const OPENED = ["waterfall", "check"]; // computed when they are opened
const opens = (verb) => OPENED.includes(verb) && !needed(verb);
// Why there is no report.
function unmade(verb) {
  const { states, files } = state.job, told = states[verb]?.state, needs = needed(verb);
  if (["waiting", "running"].includes(told)) { return "The report is being made."; }
  if (told === "failed") { return "There is no report: see above."; }
  if (verb !== "look" && needs) { return `${REPORTS[verb][1]}: ${needs}.${files.machine ? "" : " Drop it here, or make one of twelve numbers: ⋯, Machine …"}`; }
  return verb === "estimate" ? "Force and stress are not estimated yet: press Estimate." : "There is no report yet.";
}
function showViews() {
  const { states } = state.job;
  const names = Object.entries(REPORTS).map(([verb, [text, title]]) => [verb, text, { title }]);
  tabList(by("views"), [["", "Traces", { disabled: state.look ? null : "" }], ...names], state.report, (verb) => tried(showReport(verb)), "main");
  const source = states[state.report]?.report || "", seen = Boolean(state.report);
  by("main").hidden = seen || !state.look;
  by("reports").hidden = !seen;
  by("reporttab").hidden = !source;
  by("noreport").hidden = !seen || Boolean(source);
  by("noreport").textContent = seen ? unmade(state.report) : "";
  by("reportframe").hidden = !source;
  if (source && by("reportframe").getAttribute("src") !== source) { by("reportframe").src = source; by("reporttab").href = source; by("reportframe").title = REPORTS[state.report][1]; }
}
async function showReport(verb) {
  const { id, states } = state.job;
  play(false);
  state.report = verb;
  if (opens(verb) && ["failed", "cancelled"].includes(states[verb]?.state)) { state.job = await server.begin(id, verb, {}); }
  if (state.job?.id !== id) { return; }
  noted();
  await refresh();
  if (!verb && state.panels.length) { drawAll(); }
}

// ---- jobs

let shown = "";
async function refresh() {
  const id = state.job.id;
  const job = await server.job(id);
  if (state.job?.id !== id) { return; } // somebody went elsewhere meanwhile
  state.job = job;
  const done = (verb) => (job.states[verb] && job.states[verb].result) || "";
  const now = `${id} ${done("look")} ${done("estimate")}`;
  if (now !== shown) {
    const [look, estimate] = await Promise.all(["look", "estimate"].map((verb) => (done(verb) ? server.page(id, verb) : null)));
    if (state.job?.id !== id) { return; }
    shown = now;
    Object.assign(state, { look, estimate, panels: [] });
    by("main").hidden = !look || Boolean(state.report);
    if (look) {
      units.learn(look.units);
      const columns = look.places.map((place) => place.radius), [first, last] = span();
      Object.assign(state, { view: homeView(), cursor: null, impact: -1 });
      const found = await samples("look", columns, first, last, 2400);
      if (state.job?.id !== id || shown !== now) { return; }
      state.overview = { time: found.time, curves: columns.map((name) => ({ values: found[name] })) };
      state.pair = await tailPair(job);
      if (state.job?.id !== id) { return; }
      const [rest, drop] = state.pair || []; // of those sent together the drop is opened
      if (justSent === id && rest?.id === id && state.together.includes(drop.id)) { sent(drop.id); return; }
      await asSeen();
    }
  }
  if (opens(state.report) && !job.states[state.report]) { state.job = await server.begin(id, state.report, {}); }
  await showUnread();
  if (state.job?.id !== id) { return; }
  if (!showStatus()) { await askedChannels(); return; }
  setTimeout(() => { if (state.job && state.job.id === id) { refresh().catch(lost); } }, 400);
}

function lost(error) {
  if (error.status === 409) { say(error.message, "bad", ...waysOut(error.message)); return; } // damaged on the disk
  if (refused(error)) { setTimeout(() => state.job && refresh().catch(lost), 1500); }
}

// ---- views: the address says which is seen

async function openDrop(told) {
  if (state.job?.id !== told.drop) {
    Object.assign(state, { job: null, look: null, estimate: null, view: null, panels: [] });
    by("main").hidden = true;
    state.job = await server.job(told.drop);
    shown = "";
    const { id, files, states, damaged } = state.job; // one that `watch` kept was estimated without a look
    if (files?.record && states.estimate && !states.look && !damaged) { state.job = await server.begin(id, "look").catch(() => state.job); }
  }
  by("actions").hidden = by("views").hidden = false;
  by("dropname").textContent = by("dropname").title = state.job.name;
  state.report = told.report in REPORTS ? told.report : "";
  state.asked = told;
  if (shown && state.look) { await asSeen(); }
  await refresh();
}

// What the address asks for: window, cursor, mark, motion, tab.
async function asSeen() {
  const told = state.asked || {}, number = (name) => (told[name] === undefined ? NaN : Number(told[name]));
  state.asked = null;
  state.view = number("to") > number("from") ? { from: number("from"), to: number("to") } : state.view || homeView();
  state.cursor = Number.isFinite(number("at")) ? number("at") : state.cursor;
  state.mark = Number.isFinite(number("mark")) ? number("mark") : null;
  if ([...by("signal").options].some((one) => one.value === told.show)) { by("signal").value = told.show; }
  showTab(told.tab in TABS ? told.tab : state.tab);
  await loadView();
}
const seen = () => {
  const rounded = (value, size) => (value === null ? "" : String(Number(value.toPrecision(size))));
  return { drop: state.job.id, report: state.report, tab: state.tab, ...(state.view ? { from: rounded(state.view.from, 7), to: rounded(state.view.to, 7) } : {}),
    at: rounded(state.cursor, 9), mark: rounded(state.mark, 9), show: by("signal").value === "y" ? "" : by("signal").value };
};
const noted = () => address.note(() => (state.job ? seen() : address.read()));
document.addEventListener("seen", noted);

async function route() {
  address.settle();
  const told = address.read();
  if (told.token) { location.reload(); return; }
  leaveHome();
  by("unread").hidden = true;
  if (!told.drop) { await home(told); return; }
  try { await openDrop(told); } catch (error) {
    if (error.status !== 404) { throw error; }
    await home({});
    say("There is no such drop; it may have been removed.", "bad");
  }
}
async function home(told) {
  play(false);
  state.job = null;
  shown = state.report = "";
  for (const id of ["main", "reports", "views", "actions", "simulated"]) { by(id).hidden = true; }
  await showHome(told);
}

const sent = (id) => { justSent = id; if (id) { shown = ""; address.go({ drop: id }); } };
const openChosen = (list) => (list.length ? tried(chooseFiles(list, sent)) : null);

// What the recording holds is read by a process of its own, then asked.
let wantsChannels = "", channelWords = "", justSent = "";
async function channels(words = "") {
  const { id } = state.job;
  wantsChannels = id;
  channelWords = words;
  const job = await server.begin(id, "channels", {});
  if (state.job?.id !== id) { return; }
  state.job = job;
  await refresh();
}
async function askedChannels() {
  const { id, states: { channels: told, look } } = state.job;
  if (wantsChannels === id && told?.state === "done" && told.result) {
    wantsChannels = "";
    const found = await server.page(id, "channels");
    if (state.job?.id === id && (!channelWords || found.missing.length || !found.sensors.length)) { askChannels(found, channelWords, sent); }
  } else if (look?.state === "failed" && justSent === id) {
    justSent = ""; // once for every sending: whoever closes the question is not asked again
    await channels(look.error);
  }
}

// ---- wiring

const click = (id, handler) => by(id).addEventListener("click", () => tried(Promise.resolve().then(handler)));
const openFiles = () => by("files").click();
click("open", openFiles); click("open2", openFiles); click("tryit", async () => sent(await sendExample())); click("help", () => by("keys").showModal());
by("files").addEventListener("change", () => { const list = [...by("files").files]; by("files").value = ""; openChosen(list); });
click("channels", () => channels());
click("tomachine", () => chooseFiles([], sent));
click("estimate", async () => { state.job = await server.begin(state.job.id, "estimate", { method: by("method").value }); await refresh(); });
click("document", async () => keep(new Blob([await server.documentText(state.job.id, "estimate")], { type: "application/json" }), `${state.job.name}.json`));
for (const [id, role] of [["savemachine", "machine"], ["saveprofile", "profile"]]) { click(id, async () => keep(await server.sentFile(state.job.id, role), state.job.files[role].name)); }
click("remove", () => askRemoval(state.job));
click("whole", () => setWindow(...span())); click("early", () => setView(homeView()));
click("next", () => goImpact(state.impact + 1)); click("previous", () => goImpact(state.impact - 1));
click("setmark", () => (state.cursor === null ? say("Point at a trace first: the mark is set at the cursor.", "notice") : setMark(state.cursor)));
click("unmark", () => setMark(null));
click("play", () => play(state.playing === null));
by("signal").addEventListener("change", () => state.view && loadView());
document.addEventListener("click", (event) => { if (!event.target.closest("#more > summary, #more label")) { by("more").open = false; } });

const redraw = () => { if (!state.job) { redrawHome(); } else if (!state.report && state.panels.length) { drawAll(); } };
function chooseUnits(name) {
  units.choose(name);
  by("units").value = name;
  if (state.job && state.look && state.view) { showTab(state.tab); showStatus(); }
  redraw();
}
by("units").addEventListener("change", () => chooseUnits(by("units").value));
const dark = matchMedia("(prefers-color-scheme: dark)");
function chooseTheme(name) {
  localStorage.setItem("rotordrop theme", name);
  by("theme").value = name;
  document.documentElement.dataset.theme = name || (dark.matches ? "dark" : "light");
  redraw();
}
by("theme").addEventListener("change", () => chooseTheme(by("theme").value));
dark.addEventListener("change", () => chooseTheme(by("theme").value));

const KEYS = {
  n: () => goImpact(state.impact + 1), p: () => goImpact(state.impact - 1), " ": () => play(state.playing === null),
  "+": () => zoom(0.6), "=": () => zoom(0.6), "-": () => zoom(1.7), 0: () => setWindow(...span()), d: () => setView(homeView()), b: () => by("setmark").click(), m: () => channels(),
  ArrowLeft: (event) => (event.shiftKey ? pan(-1) : stepCursor(-1)), ArrowRight: (event) => (event.shiftKey ? pan(1) : stepCursor(1))
};
for (const signal of ["y", "x", "r"]) { KEYS[signal] = () => { by("signal").value = signal; loadView(); }; }
const ALWAYS = {
  "?": () => by("keys").showModal(), o: openFiles, l: () => address.go({ view: "drops" }), u: () => chooseUnits(units.chosen() === "SI" ? "US" : "SI"),
  t: () => chooseTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"), w: () => by("views").querySelector("[data-name=waterfall]")?.click(),
  Escape: () => { by("more").open = false; if (state.job && state.look && state.report) { tried(showReport("")); } }
};
document.addEventListener("keydown", (event) => {
  const list = event.target.closest("[role=tablist]");
  if (list && /^Arrow(Left|Right)$/.test(event.key)) {
    const names = [...list.querySelectorAll("[role=tab]:not(:disabled)")], step = event.key === "ArrowRight" ? 1 : names.length - 1;
    const { name } = names[(names.indexOf(event.target) + step) % names.length].dataset;
    if (list === by("tabs")) { showTab(name, true); } else { list.querySelector(`[data-name="${name}"]`).focus(); }
    return;
  }
  if (event.target.closest("input, select, textarea, dialog") || event.ctrlKey || event.metaKey || event.altKey || (event.key === " " && event.target.closest("button, summary"))) { return; }
  if (ALWAYS[event.key]) { ALWAYS[event.key](); return; }
  if (!state.report && state.job && state.look && state.view && KEYS[event.key]) { event.preventDefault(); KEYS[event.key](event); }
});
document.addEventListener("dragover", (event) => { event.preventDefault(); document.body.classList.add("over"); });
document.addEventListener("dragleave", (event) => { if (!event.relatedTarget) { document.body.classList.remove("over"); } });
document.addEventListener("drop", (event) => { event.preventDefault(); document.body.classList.remove("over"); openChosen(event.dataTransfer.files); });
let waiting = 0;
const resized = () => { clearTimeout(waiting); waiting = setTimeout(redraw, 120); };
window.addEventListener("resize", resized);
new ResizeObserver(resized).observe(by("panels")); // a line of words above them takes of their height

by("units").value = units.chosen();
chooseTheme(localStorage.getItem("rotordrop theme") || "");
window.addEventListener("hashchange", () => route().catch(lost));
route().catch(lost);
tellFormats().catch(() => {});
