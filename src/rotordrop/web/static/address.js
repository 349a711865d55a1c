// The address of a view: what is shown stands in the fragment, so that it can be kept, sent, and gone back to.
const written = (told) => `#${new URLSearchParams(Object.entries(told).filter(([, value]) => value !== undefined && value !== null && value !== ""))}`;
let waiting = 0;

export const read = () => Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
export const of = (told) => written(told);
export function go(told) {
  if (location.hash === written(told)) { window.dispatchEvent(new Event("hashchange")); } else { location.hash = written(told); }
}
export const settle = () => clearTimeout(waiting);
// What is seen now, a moment after it last changed: a cursor that moves makes no history.
export function note(tell) {
  settle();
  waiting = setTimeout(() => history.replaceState(null, "", written(tell())), 300);
}
