// Small helpers to build what the page shows.
export const byId = (id) => document.getElementById(id);

export function element(name, attributes = {}, content = []) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...(Array.isArray(content) ? content : [content]));
  return made;
}

export function svg(name, attributes = {}, content = []) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...(Array.isArray(content) ? content : [content]));
  return made;
}

export function children(parent, made) {
  parent.replaceChildren(...made);
}

export function bar(name, value, { share, rest = 0, note = "", chosen = false }) {
  const filled = element("i");
  filled.style.width = `${100 * share}%`;
  const waited = element("i", { class: "rest" });
  waited.style.width = `${100 * rest}%`;
  const row = element("div", { class: chosen ? "row chosen" : "row" }, [
    element("b", {}, name),
    element("span", { class: "track", "aria-hidden": "true" }, [filled, waited]),
    element("span", {}, value),
  ]);
  if (note) row.append(element("small", {}, note));
  return row;
}

export const colour = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// The sizes of canvases, in CSS pixels: to ask an element for its size lays out the page anew.
const sizes = new WeakMap();

// Calls `then` whenever a canvas has another size.
export function resized(canvas, then) {
  new ResizeObserver(([entry]) => {
    sizes.set(canvas, entry.contentRect);
    then();
  }).observe(canvas);
}

// Clears a canvas whose size is watched by `resized`, and returns its context.
export function cleared(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const { width, height } = sizes.get(canvas) || { width: 0, height: 0 };
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}
