// SPDX-License-Identifier: Apache-2.0
// Elements; their content is text, never markup.

export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "class") made.className = value;
    else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "dataset") Object.assign(made.dataset, value);
    else if (value !== null && value !== false) made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children.filter((child) => child !== null));
  return made;
}

// Replaces a list. The focus stays on the entry with the same data-key.
export function refill(list, rows) {
  const now = document.activeElement, key = list.contains(now) ? now.dataset.key : undefined;
  list.replaceChildren(...rows);
  if (key !== undefined) list.querySelector(`[data-key="${CSS.escape(key)}"]`)?.focus({ preventScroll: true });
}

// Returns a legend from pairs of colour and name.
export function keyOf(entries) {
  return entries.map(([colour, name]) => {
    const swatch = element("span", { class: "swatch" });
    swatch.style.background = colour;
    return element("span", { class: "entry" }, swatch, name);
  });
}

// Returns a name shortened to a number of letters.
export const short = (name, most = 28) => (name.length > most ? `${name.slice(0, most - 1)}…` : name);

// Returns the title of a panel, with A or B if two recordings are shown.
export const titled = (text, view) => (view.letter ? `${text} of ${view.letter}` : text);

let holds = null; // function that returns false once the notice no longer holds

// Shows a notice over the plan; "": none. while_: returns false once it no longer holds.
export function say(text, isWrong = false, while_ = null) {
  byId("notice").textContent = text;
  byId("news").className = text ? (isWrong ? "wrong" : "") : "none";
  holds = while_;
}

// Shows an error or a refusal over the plan.
export const warn = (text, while_ = null) => say(text, true, while_);

// Removes a notice that no longer holds.
export function expire() {
  if (holds && !holds()) say("");
}

export const byId = (id) => document.getElementById(id);

export function seconds(time, digits = 2) {
  return `${time.toFixed(digits)} s`;
}

// Returns a value of a tag in words.
export function shown(value, tag) {
  if (value === undefined) return "…";
  if (value === null || Number.isNaN(value)) return "–";
  if (tag?.texts) {
    const found = tag.texts.split(", ").find((text) => text.startsWith(`${value} `));
    if (found) return found.slice(`${value} `.length);
  }
  if (tag?.kind === "bool") return value ? "on" : "off";
  const number = Math.abs(value) >= 1000 || Number.isInteger(value) ? `${+value.toFixed(1)}` : `${+value.toPrecision(4)}`;
  return tag?.unit && tag.unit !== "1" ? `${number} ${tag.unit}` : number;
}

// Returns the context of a canvas in CSS pixels, at the size of its box; null while it has none.
export function sharp(canvas) {
  const ratio = devicePixelRatio || 1, { clientWidth, clientHeight } = canvas;
  if (!clientWidth || !clientHeight) return null;
  const [width, height] = [Math.round(clientWidth * ratio), Math.round(clientHeight * ratio)];
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, clientWidth, clientHeight);
  return context;
}
