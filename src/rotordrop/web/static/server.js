// Everything that is asked of the server. The token comes in the fragment of the address and stays in this tab.
const KEPT = "rotordrop token";
const told = new URLSearchParams(location.hash.slice(1)), given = told.get("token");
if (given) {
  sessionStorage.setItem(KEPT, given);
  told.delete("token");
  history.replaceState(null, "", `${location.pathname}${told.size ? `#${told}` : ""}`);
}
const token = sessionStorage.getItem(KEPT) || "";

export class Refusal extends Error {
  constructor(status, words) { super(words); this.status = status; }
}

async function ask(method, address, body) {
  const headers = { "X-Rotordrop-Token": token };
  const answer = await fetch(address, { method, headers, body, cache: "no-store" });
  if (!answer.ok) { throw new Refusal(answer.status, await answer.text()); }
  return answer;
}

const order = (content) => JSON.stringify(content || {});
const result = (job, verb, what) => `/api/jobs/${job}/${verb}/${what}`;

export const jobs = async () => (await (await ask("GET", "/api/jobs")).json()).jobs;
export const job = async (id) => (await ask("GET", `/api/jobs/${id}`)).json();
export const newJob = async (name, options) => (await ask("POST", "/api/jobs", order({ name, options }))).json();
export const remove = (id) => ask("DELETE", `/api/jobs/${id}`);
export const send = (id, role, file) => ask("PUT", `/api/jobs/${id}/files/${role}?name=${encodeURIComponent(file.name)}`, file);
export const setOptions = async (id, options) => (await ask("POST", `/api/jobs/${id}/options`, order(options))).json();
export const sentFile = async (id, role) => (await ask("GET", `/api/jobs/${id}/files/${role}`)).blob();
export const formats = async () => (await (await ask("GET", "/api/formats")).json()).formats;
export const example = async (name) => new File([await (await ask("GET", `/api/example/${name}`)).blob()], name);
export const begin = async (id, verb, options) => (await ask("POST", `/api/jobs/${id}/${verb}`, order(options))).json();
export const numbers = async () => (await ask("GET", "/api/numbers")).json();
export const sendNumbers = (id, values) => ask("POST", `/api/jobs/${id}/numbers`, order(values));
export const cancel = async (id, verb) => (await ask("POST", result(id, verb, "cancel"))).json();
export const page = async (id, verb) => (await ask("GET", result(id, verb, "page"))).json();
export const documentText = async (id, verb) => (await ask("GET", result(id, verb, "document"))).text();

const question = (columns, start, end, points) => new URLSearchParams([...columns.map((column) => ["column", column]), ["start", start], ["end", end], ...(points ? [["points", points]] : [])]);

// A window of histories: times [s] and one array per column, as single precision on the wire.
export async function samples(id, verb, columns, start, end, points) {
  const asked = question(columns, start, end, points);
  const bytes = await (await ask("GET", `${result(id, verb, "window")}?${asked}`)).arrayBuffer();
  const origin = new DataView(bytes).getFloat64(0, true);
  const [count] = new Uint32Array(bytes, 8, 1);
  const time = Float64Array.from(new Float32Array(bytes, 16, count), (t) => origin + t);
  const found = { time };
  columns.forEach((column, i) => { found[column] = new Float32Array(bytes, 16 + 4 * count * (i + 1), count); });
  return found;
}

export const table = async (id, verb, columns, start, end) =>
  (await ask("GET", `${result(id, verb, "csv")}?${question(columns, start, end)}`)).blob();
