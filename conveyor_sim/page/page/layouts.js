// SPDX-License-Identifier: Apache-2.0
// Layouts that the user saves by name in this browser: panel, trends, watched signals, colours, and the part of the plan that is shown.

import { byId, element, warn } from "./dom.js";

const MOST = 50; // layouts of a line
const LONGEST = 60; // letters of a name
const CHOICES = ["colour", "wear"], BOXES = ["forces", "names"];

export class Layouts {
  constructor(view) {
    const { scene, where } = view.recording.head;
    Object.assign(this, { view, key: `layouts of ${where || scene}` });
    this.name = element("input", { "aria-label": "Name of the layout", maxlength: `${LONGEST}`, required: true, placeholder: "Name" });
    this.wrong = element("p", { class: "wrong", role: "alert" });
    this.list = element("ul", { class: "rows", "aria-label": "Saved layouts" });
    this.dialog = element("dialog", { id: "layouts", "aria-label": "Layouts" }, element("h2", {}, "Layouts"), this.list,
      element("form", { class: "field", onsubmit: (event) => this._submit(event) }, this.name, element("button", { class: "main" }, "Save the present one")),
      this.wrong, element("button", { onclick: () => this.dialog.close() }, "Close"));
    document.body.append(this.dialog);
  }

  open() {
    this.wrong.textContent = "";
    this._fill();
    this.dialog.showModal();
  }

  // Returns the saved layouts by name.
  _saved() {
    let text = null;
    try {
      text = localStorage.getItem(this.key);
      const saved = JSON.parse(text ?? "{}");
      if (isRecord(saved) && Object.values(saved).every(isRecord)) return new Map(Object.entries(saved));
    } catch (error) {
      if (text === null) throw new Error("This browser stores nothing for this page.", { cause: error });
    }
    throw new Error("The stored layouts are damaged. The next one that you save replaces them.");
  }

  _read() {
    try {
      return this._saved();
    } catch (error) {
      this.wrong.textContent = error.message;
      return new Map();
    }
  }

  _store(saved) {
    try {
      localStorage.setItem(this.key, JSON.stringify(Object.fromEntries(saved)));
    } catch {
      this.wrong.textContent = "The layout can't be saved: this browser has no room for it, or stores nothing for this page.";
    }
    this._fill();
  }

  _submit(event) {
    event.preventDefault();
    const name = this.name.value.trim();
    this.wrong.textContent = "";
    if (!name) return;
    const saved = this._read();
    this.wrong.textContent = "";
    if (saved.size >= MOST && !saved.has(name)) {
      this.wrong.textContent = `${MOST} layouts are saved: delete one first.`;
      return;
    }
    this.name.value = "";
    this._store(saved.set(name, this._present()));
  }

  _fill() {
    const saved = [...this._read().keys()].sort();
    this.list.replaceChildren(...saved.map((name) => element("li", { class: "choices" },
      element("button", { "aria-label": `Show ${name}`, onclick: () => this._show(name) }, name),
      element("button", { class: "quiet", title: "Delete", "aria-label": `Delete ${name}`, onclick: () => this._delete(name) }, "✕"))),
    ...(saved.length ? [] : [element("li", { class: "muted" }, "No layout of this line is saved in this browser.")]));
  }

  _delete(name) {
    const saved = this._read();
    saved.delete(name);
    this._store(saved);
  }

  _present() {
    const { view, view: { camera, trends, tabs, watch } } = this;
    return {
      tab: tabs.shown, device: view.faceplate.device ?? "", trends: trends.names, window: trends.window, watch: [...(watch?.rows.keys() ?? [])],
      camera: camera.fitted ? null : [camera.x, camera.y, camera.scale], drawer: !byId("drawer").hidden, theme: document.documentElement.dataset.theme,
      ...Object.fromEntries(CHOICES.map((id) => [id, byId(id).value])), ...Object.fromEntries(BOXES.map((id) => [id, byId(id).checked])),
    };
  }

  // Applies a layout. Names that this line lacks are left out and reported.
  _show(name) {
    const { view, view: { camera, trends, tabs, watch } } = this, layout = this._read().get(name) ?? {}, missing = [];
    const names = (value, has) => (Array.isArray(value) ? value : []).filter((one) => typeof one === "string" && (has(one) || !missing.push(one)));
    trends.show(names(layout.trends, (one) => view.series.has(one)), layout.window);
    for (const one of watch ? names(layout.watch, (signal) => view.recording.signalIndex.has(signal)) : []) watch.add(one);
    for (const id of CHOICES) choose(byId(id), layout[id]);
    for (const id of BOXES) if (typeof layout[id] === "boolean" && byId(id).checked !== layout[id]) byId(id).click();
    if (["auto", "light", "dark"].includes(layout.theme)) document.documentElement.dataset.theme = layout.theme;
    if (typeof layout.drawer === "boolean" && byId("drawer").hidden === layout.drawer) byId("toggle_trends").click();
    view.faceplate.show(layout.device);
    if (tabs.names.includes(layout.tab)) tabs.show(layout.tab);
    const [x, y, scale] = Array.isArray(layout.camera) ? layout.camera : [];
    if ([x, y, scale].every(Number.isFinite) && scale > 0) camera.look(x, y, scale);
    else view.wholePlant();
    this.dialog.close();
    view.touch();
    if (missing.length) warn(`Not on this line, and left out of the layout: ${missing.join(", ")}`);
  }
}

const isRecord = (value) => typeof value === "object" && value !== null && !Array.isArray(value);

// Chooses an option of a list, if it has it.
function choose(list, value) {
  if (![...list.options].some((option) => option.value === value)) return;
  list.value = value;
  list.dispatchEvent(new Event("change"));
}
