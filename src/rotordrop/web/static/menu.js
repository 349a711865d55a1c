// One menu: a button and what it opens, by mouse and by keys, wherever it stands.
import { make } from "./tables.js";

let open = null;

function close(focus = false) {
  if (!open) { return; }
  const [button, list] = open;
  open = null;
  list.hidden = true;
  button.setAttribute("aria-expanded", "false");
  if (focus) { button.focus(); }
}

function show(button) {
  const list = button.nextElementSibling;
  close();
  open = [button, list];
  list.hidden = false;
  button.setAttribute("aria-expanded", "true");
  const at = button.getBoundingClientRect(), { offsetWidth: width, offsetHeight: height } = list;
  list.style.left = `${Math.max(4, Math.min(at.right - width, innerWidth - width - 4))}px`;
  list.style.top = `${at.bottom + height + 4 < innerHeight ? at.bottom + 2 : Math.max(4, at.top - height - 2)}px`;
  list.querySelector("button:not(:disabled)")?.focus();
}

export const isOpen = () => open !== null;

// items: [words, what it does, more attributes]; a menu of the page itself stands in its HTML.
export const menu = (label, title, items, more = {}) => make("span", { class: "menu", ...more, of: [
  make("button", { type: "button", text: label, title, "aria-label": title, "aria-haspopup": "menu", "aria-expanded": "false" }),
  make("span", { role: "menu", "aria-label": title, hidden: "", of: items.map(([text, click, told = {}]) => make("button", { type: "button", role: "menuitem", tabindex: "-1", text, ...told, on: { click } })) })] });

document.addEventListener("click", (event) => {
  const button = event.target.closest(".menu > button");
  if (button) { if (open && open[0] === button) { close(); } else { show(button); } return; }
  close(Boolean(open && event.target.closest("[role=menu]")) && !document.querySelector("dialog[open]"));
});
document.addEventListener("keydown", (event) => {
  if (!open) { return; }
  const items = [...open[1].querySelectorAll("button:not(:disabled)")], at = items.indexOf(document.activeElement);
  const step = { ArrowDown: 1, ArrowUp: items.length - 1 }[event.key];
  if (step) { items[(at + step) % items.length].focus(); } else if (event.key === "Escape") { close(true); } else if (event.key === "Tab") { close(); return; } else { return; }
  event.preventDefault();
  event.stopPropagation();
}, true);
window.addEventListener("resize", () => close());
document.addEventListener("scroll", () => close(), true);
