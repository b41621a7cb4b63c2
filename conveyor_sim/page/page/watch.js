// SPDX-License-Identifier: Apache-2.0
// The watch table of a running line: values of chosen signals, and forced ones.

import { field } from "./controls.js";
import { element, shown } from "./dom.js";
import { guarded, restrict } from "./rights.js";
import { SignalInput } from "./signal_input.js";

const MOST = 30;

export class Watch {
  constructor(view) {
    this.view = view;
    this.rows = new Map();
    this.field = new SignalInput("Add a signal to the watch table", () => view.recording.head.signals, (name) => this.add(name));
    this.list = element("ul", { class: "rows watched", "aria-label": "Watched signals" });
    this.none = element("p", { class: "muted" }, "Watched signals are listed here with their present values. ◎ in a faceplate adds one.");
    this.note = element("p", { class: "reason", hidden: true });
    this.root = element("section", {}, element("h2", {}, "Watch table"), ...this.field.parts, this.none, this.note, this.list);
  }

  // Adds a signal. Returns why it is refused, or "".
  add(name) {
    const { view } = this, tag = view.recording.tags.get(name);
    if (this.rows.has(name)) return "";
    if (this.rows.size >= MOST) return `The table holds ${MOST} signals: remove one first.`;
    const value = element("span", { class: "value" }), said = element("small", {});
    const remove = element("button", { class: "quiet", "aria-label": `Remove ${name}`, title: "Remove", onclick: () => { this.rows.delete(name); row.remove(); this.draw(); } }, "✕");
    const hands = view.desk?.commands ? element("div", { class: "choices" }, field(tag, "Force", (given) => view.desk.ask("force", [name], [given]), () => view.desk.rights.refusal("force"), view.signal(name)),
      guarded(element("button", { "aria-label": `End the force on ${name}`, onclick: () => view.desk.ask("unforce", [name]) }, "Unforce"), () => view.desk.rights.refusal("unforce"))) : "";
    const row = element("li", {}, element("div", { class: "watch" }, element("span", { class: "what" }, name, said), value, remove), hands);
    this.rows.set(name, { tag, value, said });
    this.list.append(row);
    this.draw();
    return "";
  }

  draw() {
    const { view } = this, forced = view.story.forcedAt(view.clock.time);
    this.none.hidden = this.rows.size > 0;
    for (const [name, { tag, value, said }] of this.rows) {
      const text = shown(view.signal(name), tag), isForced = forced.has(name);
      if (value.textContent !== text) value.textContent = text;
      said.textContent = isForced ? "forced" : "";
      value.classList.toggle("forced", isForced);
    }
    restrict(this.list, this.note);
  }
}
