// What is sent: files and what they are, a machine of twelve numbers, and which channel is which sensor.
import * as server from "./server.js";
import { by, say, state } from "./state.js";
import { make } from "./tables.js";
import * as units from "./units.js";

const NAMES = { machine: "machine file", profile: "profile of the recorder", record: "record", tail: "settled tail", beside: "named by another file", "": "leave out" };

async function rolesOf(found) {
  const texts = await Promise.all(found.map((file) => (/\.toml$/i.test(file.name) && file.size < 2e7 ? file.text() : "")));
  const machine = found.find((file, i) => texts[i] && /^\s*\[+\s*(rotor|touchdown_bearings|sensors)/m.test(texts[i])) || found.find((file, i) => texts[i] && !/^\s*\[(channels|planes|time|text|speed|units)\]/m.test(texts[i]));
  const shaft = machine ? texts[found.indexOf(machine)].match(/shaft_table\s*=\s*["']([^"']+)["']/)?.[1] : null;
  const config = found.some((file) => /\.cfg$/i.test(file.name)), asked = state.job?.states?.look?.error || ""; // a shaft table that was forgotten
  return found.map((file, i) => (file === machine ? "machine" : texts[i] ? "profile" : file.name === shaft || asked.includes(`'${file.name}'`) || (config && /\.dat$/i.test(file.name)) ? "beside"
    : /tail|settled|standstill|stillstand|ruhe|(^|[^a-z])rest(?![a-z])/i.test(file.name) ? "tail" : "record"));
}

// Ask what the files are; without files, for a machine of twelve numbers for the drop that is open.
export async function chooseFiles(list, sent) {
  const found = [...list], roles = await rolesOf(found);
  by("roles").replaceChildren(...found.map((file, n) => make("tr", { of: [make("th", { scope: "row", text: file.name }), make("td", { of: [make("select", {
    "aria-label": `What is ${file.name}`, of: Object.entries(NAMES).map(([value, text]) => make("option", { value, text, selected: value === roles[n] ? "" : null }))
  })] })] })));
  by("sendingtitle").textContent = found.length ? "What is what" : `A machine for ${state.job.name}`;
  if (!found.length) { by("numbers").open = true; }
  by("sending").showModal();
  (found.length ? by("send") : by("numberfields").querySelector("input") || by("send")).focus();
  by("sending").onclose = () => {
    if (by("sending").returnValue !== "send") { return; }
    const chosen = [...by("roles").querySelectorAll("select")].map((one) => one.value);
    sendFiles(found.map((file, i) => [chosen[i], file]).filter(([what]) => what)).then(sent).catch((error) => say(error.message, "bad"));
  };
}

by("numbers").addEventListener("toggle", async () => {
  if (!by("numbers").open || by("numberfields").children.length) { return; }
  try {
    const { properties, required } = await server.numbers();
    by("numberfields").replaceChildren(...Object.entries(properties).map(([name, { description, examples }]) => make("label", {
      of: [make("span", { text: `${description.replace(/ \[\S+?( [^\]]*)?\]/, "$1")}${required.includes(name) ? "" : " (optional)"}` }), make("input", { name, placeholder: examples[0], maxlength: 120, autocomplete: "off" })]
    })));
    by("numberfields").querySelector("input").focus();
  } catch (error) { say(error.message, "bad"); }
});
const numbersGiven = () => Object.fromEntries([...by("numberfields").querySelectorAll("input")].map((one) => [one.name, one.value.trim()]).filter(([, value]) => value));
const textFile = (name, text) => new File([text], name, { type: "text/plain" });

async function sendTo(id, pairs, numbers) {
  for (const [what, file] of pairs) {
    say(`Sending ${file.name} …`, "notice");
    await server.send(id, what, file);
  }
  if (Object.keys(numbers).length && !pairs.some(([what]) => what === "machine")) { await server.sendNumbers(id, numbers); }
  await server.begin(id, "look");
}

async function sendFiles(pairs) {
  const records = pairs.filter(([what]) => what === "record"), others = pairs.filter(([what]) => what !== "record"), numbers = numbersGiven();
  const options = Object.fromEntries(["gap", "speed", "operator"].map((name) => [name, by(name).value.trim()]).filter(([, value]) => value));
  if (!records.length) {
    if (!state.job || !(others.length || Object.keys(numbers).length)) { say("None of these files is a record. Open a drop first to give it what belongs to it.", "bad"); return state.job?.id; }
    if (Object.keys(options).length) { await server.setOptions(state.job.id, options); }
    await sendTo(state.job.id, others, numbers);
    return state.job.id;
  }
  let last = null;
  state.together = [];
  for (const pair of records) {
    const job = await server.newJob(pair[1].name.replace(/\.[^.]+$/, ""), options);
    try { await sendTo(job.id, [...others, pair], numbers); } catch (error) { await server.remove(job.id); throw error; }
    state.together.push(last = job.id);
  }
  return last;
}

// A record in which nothing falls, and a drop of the same machine with neither tail nor estimate; null where there are no two.
export async function tailPair(job) {
  const rests = ({ row }) => row?.falls === false, open = ({ files, states }) => files.record && !files.tail && !states.estimate?.result;
  const fits = (one) => one.id !== job.id && one.files.machine?.sha256 === job.files.machine?.sha256 && open(one) && rests(one) !== rests(job);
  const other = open(job) ? (await server.jobs()).find(fits) : null;
  return other ? (rests(job) ? [job, other] : [other, job]) : null;
}
export async function useTail(rest, drop) {
  const give = async (what) => server.send(drop.id, what === "record" ? "tail" : what, new File([await server.sentFile(rest.id, what)], rest.files[what].name));
  await give("record");
  if (rest.files.profile && !drop.files.profile) { await give("profile"); }
  await server.remove(rest.id);
  await server.begin(drop.id, "look");
  return drop.id;
}

// The bundled machine with its simulated drop, as if its files had been dropped here.
const EXAMPLE = [["machine", "lp400.toml"], ["beside", "lp400_shaft.csv"], ["record", "drop_060.h5"], ["tail", "drop_060_tail.csv"]];
export const sendExample = async () => sendFiles(await Promise.all(EXAMPLE.map(async ([what, name]) => [what, await server.example(name)])));

// ---- channels

const toml = (value) => (Array.isArray(value) ? `[${value.map(toml).join(", ")}]` : typeof value === "string" ? JSON.stringify(value).replaceAll("\u007f", "\\u007f") : String(value));
export function tomlOf(table) {
  const plain = Object.entries(table).filter(([, value]) => value !== undefined && (typeof value !== "object" || Array.isArray(value)));
  const parts = Object.entries(table).filter(([, value]) => value && typeof value === "object" && !Array.isArray(value) && Object.keys(value).length);
  const line = ([name, value]) => `${JSON.stringify(name)} = ${toml(value)}`;
  return [...plain.map(line), ...parts.flatMap(([name, part]) => ["", `[${name}]`, ...Object.entries(part).filter(([, value]) => value !== undefined).map(line)]), ""].join("\n");
}

// A channel as it is chosen: the end of a long name tells more than its beginning, and the range must be seen.
const LABEL = 22;
const spoken = ({ label, range }) => `${label.length > LABEL ? `…${label.slice(1 - LABEL)}` : label}, ${range[units.chosen()]}`;
function drawn(values) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg"), line = document.createElementNS(svg.namespaceURI, "polyline");
  svg.setAttribute("class", "trace");
  svg.setAttribute("viewBox", "-1 -1 82 22");
  svg.setAttribute("aria-hidden", "true");
  line.setAttribute("points", (values || []).map((y, i) => (y === null ? "" : `${((80 * i) / Math.max(values.length - 1, 1)).toFixed(1)},${(20 - 20 * y).toFixed(1)}`)).join(" "));
  svg.append(line);
  return svg;
}
const choice = (name, options, chosen, label) => make("select", { name, "aria-label": label, of: options.map(([value, text]) => make("option", { value, text, selected: value === chosen ? "" : null })) });
const entry = (name, value, placeholder, label) => make("input", { name, value: value || "", placeholder, "aria-label": label, maxlength: 120, autocomplete: "off", size: 12 });

// Which channel is which sensor, and what the recording does not say itself; the answer is kept as a profile.
export function askChannels({ channels, sensors, profile, likely, likely_by: rule }, words, sent) {
  const rows = [];
  const options = [["", "–"], ...channels.map((one) => [one.label, spoken(one)])];
  const pairs = Object.entries(profile.planes || (sensors.length ? {} : likely)).flatMap(([plane, text]) => text.split(", ").map((said, i) => {
    const [, channel, degrees] = said.match(/^(.*?)(?: +([-+]?[0-9.]+) *(?:deg|°))?$/);
    return { name: `sensor ${i + 1}`, plane, channel, angle: degrees ? (Number(degrees) * Math.PI) / 180 : (i % 2) * Math.PI / 2 };
  }));
  const places = sensors.length ? sensors : pairs.length ? pairs : ["NDE", "NDE", "DE", "DE"].map((plane, i) => ({ name: `sensor ${i + 1}`, plane, angle: (i % 2) * Math.PI / 2 }));
  for (const sensor of places) {
    const chosen = profile.channels?.[sensor.name] || sensor.channel || likely[sensor.name] || "", degrees = `${Number(((sensor.angle * 180) / Math.PI).toFixed(1))} deg`;
    rows.push(make("tr", { of: [make("th", { scope: "row", text: sensor.name }),
      make("td", { of: [sensors.length ? make("span", { text: sensor.plane }) : entry("plane", sensor.plane, "NDE", `Plane of ${sensor.name}`)] }),
      make("td", { of: [sensors.length ? make("span", { text: degrees.replace("-", "−").replace(" deg", "°") }) : entry("angle", degrees, "0 deg", `Angle of ${sensor.name}, from +x`)] }),
      make("td", { of: [choice("channel", options, chosen, `Channel of ${sensor.name}`)] }), make("td", { of: [drawn(channels.find(({ label }) => label === chosen)?.trace)] })] }));
    const row = rows.at(-1), select = row.querySelector("select");
    select.addEventListener("change", () => row.lastElementChild.replaceChildren(drawn(channels.find(({ label }) => label === select.value)?.trace)));
  }
  by("channelrows").replaceChildren(...rows);
  const speed = profile.speed || {}, source = speed.channel ? `channel ${speed.channel}` : speed.pulses ? `pulses ${speed.pulses}` : speed.constant ? "constant" : "";
  by("speedfrom").replaceChildren(choice("speedfrom", [["", "as the recording says"], ["constant", "by hand"],
    ...channels.flatMap(({ label }) => [[`channel ${label}`, `speed channel ${label}`], [`pulses ${label}`, `pulses in ${label}`]])], source, "Shaft speed from"));
  by("speedhand").value = speed.constant || "";
  by("unitgiven").value = profile.unit || "";
  by("sensitivity").value = profile.sensitivity || "";
  by("fullscale").value = profile.full_scale || "";
  by("fullscale").parentElement.hidden = !profile.full_scale && !channels.some(({ unit }) => unit === "of full scale");
  const supposed = sensors.length ? sensors.some(({ name }) => likely[name] && !profile.channels?.[name]) : !profile.planes && pairs.length;
  by("channelwords").textContent = [words, supposed ? `Chosen below is what is likeliest: ${rule}.` : ""].filter(Boolean).join(". ");
  by("mapping").showModal();
  by("mapping").querySelector(".main").focus();
  by("mapping").onclose = () => {
    if (by("mapping").returnValue !== "send") { return; }
    sendChannels(places, sensors.length > 0, profile).then(sent).catch((error) => say(error.message, "bad"));
  };
}

async function sendChannels(places, known, profile) {
  const told = [...by("channelrows").children].map((row) => Object.fromEntries([...row.querySelectorAll("select, input")].map((one) => [one.name, one.value.trim()])));
  const from = by("speedfrom").querySelector("select").value, [kind, ...label] = from.split(" "), hand = by("speedhand").value.trim();
  const speed = kind === "constant" || (!from && hand) ? { constant: hand || undefined } : from ? { ...profile.speed, constant: undefined, channel: undefined, pulses: undefined, [kind]: label.join(" ") } : undefined;
  const channels = known ? Object.fromEntries(places.map(({ name }, i) => [name, told[i].channel]).filter(([, channel]) => channel)) : {};
  const made = { ...profile, unit: by("unitgiven").value.trim() || undefined, sensitivity: by("sensitivity").value.trim() || undefined, full_scale: by("fullscale").value.trim() || undefined, channels, planes: undefined, speed };
  const { id } = state.job;
  if (!known) {
    const planes = new Map();
    for (const { plane, angle, channel } of told.filter((one) => one.channel)) { planes.set(plane, [...(planes.get(plane) || []), `${channel} ${angle}`]); }
    await server.setOptions(id, { planes: [...planes].map(([plane, sensors]) => `${plane}: ${sensors.join(", ")}`).join("; ") });
  }
  if (speed?.constant) { await server.setOptions(id, { speed: "" }); }
  await server.send(id, "profile", textFile("profile.toml", tomlOf(made)));
  await server.begin(id, "look");
  return id;
}

export async function tellFormats() {
  by("formats").textContent = `Recordings: ${(await server.formats()).map((name) => `.${name}`).join(", ")}.`;
}
