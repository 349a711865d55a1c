// The page: one job, its tabs and its status, and what every button and key does.
import { askChannels, chooseFiles, sendExample, tellFormats } from "./sending.js";
import * as address from "./address.js";
import { centrelineTab } from "./centreline.js";
import { chooseOthers, compareTab, learnDrops } from "./compare.js";
import { makeOrbits, nextImpact, pan, play, setMark, setView, setWindow, stepCursor, zoom } from "./cursor.js";
import { keep } from "./figures.js";
import { addToLog, askAbout, askRemoval, leaveHome, redrawHome, showHome } from "./home.js";
import { leaveMachines, showMachines } from "./machines.js";
import { redoLog, redrawLog, showLog } from "./log.js";
import { drawAll, FIGURES, isShown, lines, loadView, traces } from "./panels.js";
import { rotorTab } from "./rotor.js";
import * as server from "./server.js";
import { by, events, files, homeView, impacts, origin, samples, say, showLines, simulated, span, state, notes, zero } from "./state.js";
import { cards, facts, findings, impactTable, levelOf, make, sentence, table, timeline } from "./tables.js";
import { cutFiles, drawFall, fallFiles, fallSeen, fallWanted, openFall } from "./waterfall.js";
import * as units from "./units.js";

const timeOf = (verb) => (t) => units.eventText(verb === "look" ? t - zero() : t);

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
    return [...(list.length ? [impactTable(list.slice(0, 400), source.impact_columns, state.impact, timeOf("estimate"), goImpact), ...levelOf(list.map((one) => one.numbers))] : [make("p", { text: "No impacts." })]),
      ...(source === state.estimate ? [make("p", { class: "small", text: "By the estimated contacts, in place of the count of the first look, which has the displacement alone. The report lists every contact." })] : []),
      make("span", { class: "files", of: [make("button", { text: "as Python", on: { click: () => showLines(lines(source === state.look ? "look" : "estimate", "impacts")) } })] })];
  },
  Events: () => [...(notes().length ? [make("h3", { class: "part", text: "Notes" }), make("ol", { class: "timeline", of: notes().map((note) => make("li", { of: [
      make("button", { class: "link", text: units.eventText(note.time), on: { click: () => { state.cursor = note.time; setView({ from: note.time - 0.05, to: note.time + 0.1 }); } } }), make("span", { text: note.text }),
      make("button", { class: "link", text: "✕", "aria-label": `Remove the note ${note.text}`, on: { click: () => keepNotes(notes().filter((one) => one !== note)).catch(lost) } })] })) }), make("h3", { class: "part", text: "Events" })] : []),
    make("p", { class: "small", text: `Times count from ${origin()}${state.estimate ? "" : "; an interval beside an event is its own, on the clock of the record"}.` }),
    timeline(events(), units.eventText, (time) => { state.cursor = time; setView({ from: time - 0.05, to: time + 0.1 }); })],
  Numbers: () => {
    const page = state.estimate || state.look;
    const folded = page.verdict.filter((one) => page.assumptions?.includes(one.text)), list = (some) => make("ul", { class: "statements", of: some.map(sentence) });
    const [first, ...rest] = page.verdict, todo = page.to_do;
    return [list([first]), ...(todo ? [make("h3", { class: "part", text: todo.heading }), list(todo.statements)] : []), cards(page.cards), list(rest.filter((one) => !folded.includes(one))),
      ...(folded.length ? [make("details", { of: [make("summary", { text: `${folded.length} more notes and assumptions` }), list(folded)] })] : []), ...(state.estimate ? page.summary : []).map(table)];
  },
  Quality: () => [findings(state.estimate?.findings || state.look.findings), make("p", { class: "small", text: (state.estimate || state.look).not_seen || "" }), ...(!state.estimate && state.look.sections.at(-1)?.statements || []).map((one) => make("p", { class: "small", text: one.text }))],
  Restart: () => {
    const card = state.estimate?.restart;
    if (!card) { return [make("p", { text: "An estimate of this drop is needed to weigh whether the machine may run again." })]; }
    return [make("ul", { class: "statements", of: card.verdict.map(sentence) }), ...card.summary.map(table), ...card.sections.flatMap((part) => [
      make("h3", { class: "part", text: part.heading }), ...part.text.map((text) => make("p", { text: units.inWords(text) })), ...part.tables.map(table)])];
  },
  All: () => (state.estimate || state.look).sections.filter((part) => part.text.length + part.statements.length + part.tables.length).flatMap((part) => [make("h3", { class: "part", text: part.heading }),
    ...part.text.map((text) => make("p", { text: units.inWords(text) })), make("ul", { class: "statements", of: part.statements.map(sentence) }), ...part.tables.map(table)]),
  Centre: centrelineTab,
  Compare: compareTab,
  Rotor: rotorTab,
  Origin: () => [facts((state.estimate || state.look).facts), facts(Object.entries(state.job.files).map(([role, file]) => [role, `${file.name}, ${file.bytes} bytes, SHA-256 ${file.sha256}`])),
    make("p", { of: Object.entries(state.job.files).filter(([role]) => ["machine", "profile"].includes(role)).map(([role, file]) => make("button", { text: `Save ${file.name}`, on: { click: async () => keep(await server.sentFile(state.job.id, role), file.name) } })) })]
};

function showTab(name, focus = false) {
  state.tab = name;
  by("tabs").replaceChildren(...Object.keys(TABS).map((text) => make("button", {
    role: "tab", text, "aria-selected": String(text === name), tabindex: text === name ? "0" : "-1", "aria-controls": "tabpanel", on: { click: () => showTab(text, true) }
  })));
  if (focus) { by("tabs").querySelector('[aria-selected="true"]').focus(); }
  by("tabpanel").setAttribute("aria-label", name);
  by("tabpanel").replaceChildren(...TABS[name]());
  noted();
}

function showStatus() {
  const { states } = state.job, { look, estimate, waterfall, channels } = states;
  for (const id of ["estimate", "report", "document", "waterfall", "channels", "tomachine", "tothelog", "aboutdrop"]) { by(id).disabled = Boolean(state.job.damaged); }
  if (state.job.damaged) { say(state.job.damaged, "bad", make("button", { text: "Remove", on: { click: () => askRemoval(state.job) } })); return false; }
  const running = [estimate, waterfall, look, channels].find((one) => one && ["waiting", "running"].includes(one.state));
  by("estimate").disabled = Boolean(running) || !state.job.files.machine || !state.look;
  by("report").disabled = by("document").disabled = by("tothelog").disabled = !(estimate && estimate.result);
  by("waterfall").disabled = !(waterfall && waterfall.result) && by("estimate").disabled;
  by("why").textContent = whyNot(running, estimate);
  for (const id of ["document", "tothelog"]) { by(id).textContent = by(id).textContent.replace(UNESTIMATED, "") + (by(id).disabled ? UNESTIMATED : ""); }
  by("tomachine").hidden = Boolean(state.job.files.machine);
  by("simulated").hidden = !simulated();
  by("simulated").title = simulated();
  by("waterfall").title = "Frequencies of the coast-down, found and named; needs a record to standstill, or nearly";
  if (running) {
    const verb = Object.keys(states).find((one) => states[one] === running), share = running.fraction || 0;
    const stage = running.state === "waiting" ? "waiting for another computation" : running.stage || ({ look: "reading and checking the record", channels: "reading the record" }[verb] || "compiling and preparing");
    const seconds = Math.round(running.left || 0), left = seconds ? `, about ${seconds} s left` : "";
    const bar = make("progress", { max: 1, "aria-label": stage, ...(share > 0 ? { value: share } : {}) });
    say(`${{ channels: "Channels", look: "Looking", estimate: "Estimating", waterfall: "Waterfall" }[verb]}: ${stage} (${Math.round(running.spent)} s${left})`, "notice", bar,
      make("button", { text: "Cancel", id: "cancel", on: { click: async () => { state.job = await server.cancel(state.job.id, verb); await refresh(); } } }));
    return true;
  }
  const failed = [waterfall, estimate, look].find((one) => one && one.state === "failed");
  if (failed) { say(failed.error, "bad", ...(failed === estimate || failed === waterfall ? [] : waysOut(failed.error))); }
  else if (state.estimate) {
    say(state.estimate.verdict[0].text, state.estimate.verdict[0].level, ...state.estimate.cards.map(({ title, figures: [first] }) => {
      const [text, interval] = first.value[units.chosen()];
      return make("span", { class: "headline", of: [make("span", { text: `${title.split(" touchdown")[0]} ${first.label.toLowerCase()} ` }), make("strong", { text }), make("span", { class: "note", text: interval ? ` (90 %: ${interval})` : "" })] });
    }));
  }
  else if (state.look) {
    const told = state.look.verdict[0], stop = state.look.findings.find((one) => one.severity === "stop"), words = estimate && estimate.state === "cancelled" ? "The estimate was cancelled. " : "";
    say(words + (stop ? `${stop.message}; ${stop.remedy}` : told.text), stop ? "bad" : told.level);
  } else { say("Nothing was found yet.", "notice"); }
  return false;
}

// Why a button of the drop cannot be pressed.
const UNESTIMATED = " (needs an estimate)";
function whyNot(running, estimate) {
  if (running) { return "one computation of a drop at a time"; }
  if (!state.look) { return "Estimate and Waterfall need a readable record"; }
  if (!state.job.files.machine) { return "Estimate and Waterfall need the machine file"; }
  return estimate?.result ? "" : "Report needs an estimate";
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
  const text = await (await server.sentFile(id, role)).slice(0, SHOWN_CHARACTERS).text();
  by("unread").append(make("p", { class: "small", text: "It begins with these lines:" }),
    make("ol", { class: "begins", of: text.split(/\r?\n/).slice(0, SHOWN_LINES).map((line) => make("li", { of: [make("code", { text: line })] })) }));
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
  if (wantsFall === id && done("waterfall")) { wantsFall = ""; await showFall(); }
  if (now !== shown) {
    const [look, estimate] = await Promise.all(["look", "estimate"].map((verb) => (done(verb) ? server.page(id, verb) : null)));
    if (state.job?.id !== id) { return; }
    shown = now;
    Object.assign(state, { look, estimate, panels: [] });
    if (state.othersOf !== id) { Object.assign(state, { othersOf: id, others: [] }); }
    if (estimate) { await learnDrops(); }
    by("main").hidden = !look || !by("fall").hidden;
    if (look) {
      units.learn(look.units);
      const columns = look.places.map((place) => place.radius), [first, last] = span();
      Object.assign(state, { view: homeView(), cursor: null, impact: -1 });
      const found = await samples("look", columns, first, last, 2400);
      if (state.job?.id !== id || shown !== now) { return; }
      state.overview = { time: found.time, data: { time: found.time, curves: columns.map((name) => ({ values: found[name] })) } };
      await asSeen();
    }
  }
  await showUnread();
  if (state.job?.id !== id) { return; }
  if (!showStatus()) { await askedChannels(); return; }
  setTimeout(() => { if (state.job && state.job.id === id) { refresh().catch(lost); } }, 400);
}

function lost(error) {
  if (error.status === 409) { say(error.message, "bad", ...waysOut(error.message)); return; } // damaged on the disk
  say(error instanceof server.Refusal ? error.message : "The server does not answer; is 'rotordrop serve' running? The page tries again.", "bad");
  if (!(error instanceof server.Refusal)) { setTimeout(() => state.job && refresh().catch(lost), 1500); }
}

// ---- notes at an instant, and which figures are drawn

async function keepNotes(list) {
  state.job = await server.label(state.job.id, { notes: list });
  if (state.tab === "Events") { showTab("Events"); }
  drawAll();
}
function askNote() {
  if (!state.job || state.cursor === null) { say("Point at a trace first: a note stands at the cursor.", "notice"); return; }
  const time = state.cursor;
  by("instantwhen").textContent = `At ${units.eventText(time)} from ${origin()}`;
  by("instanttext").value = "";
  by("instant").showModal();
  by("instanttext").focus();
  by("instant").onclose = () => { if (by("instant").returnValue === "keep") { keepNotes([...notes(), { time, text: by("instanttext").value }]).catch(lost); } };
}
function chooseTraces() {
  const box = (value, text, checked) => make("label", { class: "choice", of: [make("input", { type: "checkbox", value, ...(checked ? { checked: "" } : {}) }), make("span", { text })] });
  const list = traces(), chosen = (id) => [...by(id).querySelectorAll("input")].filter((one) => one.checked).map((one) => one.value);
  by("figurechoices").replaceChildren(...FIGURES().map(([id, text]) => box(id, text, isShown(id))));
  by("tracechoices").replaceChildren(...list.map((one) => box(one.key, one.label, state.own.includes(one.key))));
  const limit = () => {
    const first = list.find((one) => one.key === chosen("tracechoices")[0]), many = chosen("tracechoices").length >= 8;
    [...by("tracechoices").querySelectorAll("input")].forEach((input, i) => { input.disabled = Boolean(first) && (list[i].kind !== first.kind || list[i].verb !== first.verb || (many && !input.checked)); });
  };
  by("tracechoices").onchange = limit;
  limit();
  by("figuresdialog").showModal();
  by("figuresdialog").onclose = () => {
    const { returnValue } = by("figuresdialog");
    if (returnValue === "usual") { Object.assign(state, { figures: null, own: [] }); }
    if (returnValue === "choose") {
      const shownNow = chosen("figurechoices"), own = chosen("tracechoices");
      Object.assign(state, { figures: shownNow.length || own.length ? shownNow : null, own });
    }
    if (returnValue !== "cancel") { loadView(); }
  };
}

// ---- views: the address says which is seen

const part = (name) => (name in TABS ? name : "Impacts");
async function openDrop(told) {
  if (state.job?.id !== told.drop) {
    leaveFall();
    Object.assign(state, { job: null, look: null, estimate: null, view: null, panels: [] });
    by("main").hidden = true;
    state.job = await server.job(told.drop);
    shown = "";
  }
  by("actions").hidden = false;
  by("dropname").textContent = by("dropname").title = state.job.name;
  state.asked = told;
  if (shown && state.look) { await asSeen(); }
  await refresh();
}

// What the address asks for: window, cursor, motion, tab, others, waterfall.
async function asSeen() {
  const told = state.asked || {}, number = (name) => (told[name] === undefined ? NaN : Number(told[name]));
  state.asked = null;
  state.view = number("to") > number("from") ? { from: number("from"), to: number("to") } : state.view || homeView();
  state.cursor = Number.isFinite(number("at")) ? number("at") : state.cursor;
  by("orbitof").value = ["turn", "1X"].includes(told.orbit) ? told.orbit : "window";
  state.mark = Number.isFinite(number("mark")) ? number("mark") : null;
  state.figures = told.figures ? told.figures.split(",") : null;
  state.own = told.traces ? told.traces.split(",") : [];
  if ([...by("signal").options].some((one) => one.value === told.show)) { by("signal").value = told.show; }
  showTab(part(told.tab || state.tab));
  await loadView();
  if (told.with) { await learnDrops(told.with.split(",")); }
  if (told.view === "waterfall") { fallWanted(told); }
  if (told.view === "waterfall") { if (by("fall").hidden) { await waterfall(); } } else { leaveFall(); }
}
const seen = () => {
  const rounded = (value, size) => (value === null ? "" : String(Number(value.toPrecision(size))));
  return { drop: state.job.id, ...(by("fall").hidden ? {} : { view: "waterfall", ...fallSeen() }), tab: state.tab, ...(state.view ? { from: rounded(state.view.from, 7), to: rounded(state.view.to, 7) } : {}),
    at: rounded(state.cursor, 9), show: by("signal").value === "y" ? "" : by("signal").value, mark: rounded(state.mark, 9), orbit: by("orbitof").value === "window" ? "" : by("orbitof").value,
    figures: (state.figures || []).join(","), traces: state.own.join(","), with: state.others.map((other) => other.job).filter(Boolean).join(",") };
};
const noted = () => address.note(() => (state.job ? seen() : address.read()));
document.addEventListener("seen", noted);

async function route() {
  address.settle();
  const told = address.read(), atDrop = Boolean(told.drop);
  if (told.token) { location.reload(); return; }
  const place = atDrop ? "" : { log: "tolog", machines: "tomachines", machine: "tomachines" }[told.view] || "todrops";
  for (const id of ["todrops", "tomachines", "tolog"]) { if (id === place) { by(id).setAttribute("aria-current", "page"); } else { by(id).removeAttribute("aria-current"); } }
  leaveHome();
  leaveMachines();
  by("unread").hidden = true;
  by("log").hidden = true;
  if (atDrop) {
    try { await openDrop(told); } catch (error) {
      if (error.status !== 404) { throw error; }
      await home({});
      say("There is no such drop; it may have been removed.", "bad");
    }
    return;
  }
  await home(told);
}
async function home(told) {
  leaveFall();
  play(false);
  state.job = null;
  shown = "";
  by("main").hidden = by("actions").hidden = by("simulated").hidden = true;
  if (told.view === "log") { await showLog(told); } else if (["machines", "machine"].includes(told.view)) { await showMachines(told); } else { await showHome(told); }
}

const sent = (id, kind = "drop") => {
  if (kind === "machine") { address.go({ view: "machines" }); return; }
  justSent = id;
  if (id) { shown = ""; address.go({ drop: id }); }
};
const openChosen = (list) => (list.length ? chooseFiles(list, sent).catch((error) => say(error.message, "bad")) : null);

// What the recording holds is read by a process of its own, then asked.
let wantsChannels = "";
async function channels(words = "") {
  const { id } = state.job;
  wantsChannels = id;
  channelWords = words;
  const job = await server.begin(id, "channels", {});
  if (state.job?.id !== id) { return; }
  state.job = job;
  await refresh();
}
let channelWords = "", justSent = "";
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

const click = (id, handler) => by(id).addEventListener("click", () => Promise.resolve(handler()).catch((error) => say(error.message, "bad")));
const openFiles = () => by("files").click();
click("open", openFiles); click("open2", openFiles); click("tryit", async () => sent(await sendExample())); click("help", () => by("keys").showModal());
by("files").addEventListener("change", () => { const list = [...by("files").files]; by("files").value = ""; openChosen(list); });
click("channels", () => channels());
click("tomachine", () => chooseFiles([], sent));
click("aboutdrop", () => askAbout(state.job, (job) => { state.job = job; by("dropname").textContent = by("dropname").title = job.name; }));
click("tothelog", () => addToLog(state.job));
click("estimate", async () => { state.job = await server.begin(state.job.id, "estimate", { method: by("method").value }); await refresh(); });
click("report", () => server.openReport(state.job.id, "estimate"));
let wantsFall = "";
async function showFall() {
  const { id } = state.job, page = await server.page(id, "waterfall");
  if (state.job.id !== id) { return; }
  play(false);
  by("main").hidden = true;
  by("fall").hidden = false;
  noted();
  await openFall(id, page);
  by("fallmap").focus();
}
function leaveFall() {
  if (by("fall").hidden) { return; }
  by("fall").hidden = true;
  by("main").hidden = !state.look;
  if (state.job) { noted(); }
  if (state.panels.length) { drawAll(); }
  by("waterfall").focus();
}
async function waterfall() {
  const told = state.job.states.waterfall;
  if (told && told.result) { await showFall(); return; }
  wantsFall = state.job.id;
  state.job = await server.begin(state.job.id, "waterfall", {});
  await refresh();
}
click("waterfall", waterfall);
click("fallback", leaveFall);
click("fallreport", () => server.openReport(state.job.id, "waterfall"));
by("fallfiles").replaceChildren(files("Waterfall", { csv: fallFiles.CSV, svg: fallFiles.SVG, png: fallFiles.PNG, python: () => showLines(fallFiles.Python()), command: () => showLines(fallFiles.Command(), "As command") }));
by("cutfiles").replaceChildren(files("Cuts", { csv: cutFiles.CSV, svg: cutFiles.SVG, png: cutFiles.PNG, python: () => showLines(cutFiles.Python()) }));
click("document", async () => keep(new Blob([await server.documentText(state.job.id, "estimate")], { type: "application/json" }), `${state.job.name}.json`));
click("remove", () => askRemoval(state.job));
click("whole", () => setWindow(...span())); click("early", () => setView(homeView()));
click("next", () => goImpact(nextImpact(1))); click("previous", () => goImpact(nextImpact(-1)));
click("setmark", () => (state.cursor === null ? say("Point at a trace first: the mark is set at the cursor.", "notice") : setMark(state.cursor)));
click("unmark", () => setMark(null)); click("noteat", askNote); click("choosetraces", chooseTraces);
click("play", () => play(state.playing === null));
by("orbitof").addEventListener("change", () => state.view && makeOrbits());
by("signal").addEventListener("change", () => state.view && loadView());
function chooseUnits(name) { units.choose(name); by("units").value = name; if (state.job && state.look && state.view) { showTab(state.tab); showStatus(); redraw(); } else if (!state.job) { redrawHome(); if (!by("log").hidden) { redoLog(); } } }
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
  n: () => goImpact(nextImpact(1)), p: () => goImpact(nextImpact(-1)), " ": () => play(state.playing === null),
  "+": () => zoom(0.6), "=": () => zoom(0.6), "-": () => zoom(1.7), 0: () => setWindow(...span()), d: () => setView(homeView()),
  b: () => by("setmark").click(), i: askNote, f: chooseTraces,
  c: () => chooseOthers().catch((error) => say(error.message, "bad")), m: () => channels(),
  u: () => chooseUnits(units.chosen() === "SI" ? "US" : "SI"), t: () => chooseTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"),
  ArrowLeft: (event) => (event.shiftKey ? pan(-1) : stepCursor(-1)), ArrowRight: (event) => (event.shiftKey ? pan(1) : stepCursor(1))
};
for (const signal of ["y", "x", "r"]) { KEYS[signal] = () => { by("signal").value = signal; loadView(); }; }
document.addEventListener("keydown", (event) => {
  const typing = event.target.closest("input, select, textarea, dialog, [role=menu]");
  if (event.target.closest("[role=tablist]") && /^Arrow(Left|Right)$/.test(event.key)) {
    const names = Object.keys(TABS), step = event.key === "ArrowRight" ? 1 : names.length - 1;
    showTab(names[(names.indexOf(state.tab) + step) % names.length], true);
    return;
  }
  if (typing || event.ctrlKey || event.metaKey || event.altKey || (event.key === " " && event.target.closest("button"))) { return; }
  if (event.key === "?") { by("keys").showModal(); return; }
  if (event.key === "o") { openFiles(); return; }
  if (event.key === "l") { address.go({ view: "drops" }); return; }
  if (event.key === "w" && !by("waterfall").disabled && !by("actions").hidden) { (by("fall").hidden ? waterfall : leaveFall)(); return; }
  if (event.key === "Escape") { leaveFall(); return; }
  if ("ut".includes(event.key)) { KEYS[event.key](); return; }
  if (by("fall").hidden && state.job && state.look && state.view && KEYS[event.key]) { event.preventDefault(); KEYS[event.key](event); }
});
document.addEventListener("compared", () => showTab("Compare"));
document.addEventListener("dragover", (event) => { event.preventDefault(); document.body.classList.add("over"); });
document.addEventListener("dragleave", (event) => { if (!event.relatedTarget) { document.body.classList.remove("over"); } });
document.addEventListener("drop", (event) => { event.preventDefault(); document.body.classList.remove("over"); openChosen(event.dataTransfer.files); });
const redraw = () => {
  if (!state.job) { redrawLog(); } else if (!by("fall").hidden) { drawFall(); } else if (state.panels.length) { drawAll(); if (["Centre", "Compare", "Rotor"].includes(state.tab)) { showTab(state.tab); } }
};
let waiting = 0;
const resized = () => { clearTimeout(waiting); waiting = setTimeout(redraw, 120); };
window.addEventListener("resize", resized);
new ResizeObserver(resized).observe(by("panels")); // a line of words above them takes of their height

by("units").value = units.chosen();
chooseTheme(localStorage.getItem("rotordrop theme") || "");
window.addEventListener("hashchange", () => route().catch(lost));
route().catch(lost);
tellFormats().catch(() => {});
