// The watch table of a running line: values of chosen signals, and forced ones.

import { field } from "./controls.js";
import { element, shown } from "./dom.js";
import { guarded, restrict } from "./rights.js";

const MOST = 30;

export class Watch {
  constructor(view) {
    this.view = view;
    this.rows = new Map();
    this.input = element("input", { list: "signals", placeholder: "Add a signal …", "aria-label": "Add a signal to the watch table", onchange: () => this._typed() });
    this.list = element("ul", { class: "rows watched", "aria-label": "Watched signals" });
    this.none = element("p", { class: "muted" }, "Watched signals are listed here with their present values. ◎ in a faceplate adds one.");
    this.note = element("p", { class: "reason", hidden: true });
    this.root = element("section", {}, element("h2", {}, "Watch table"), this.input, this.none, this.note, this.list);
  }

  _typed() {
    if (this.add(this.input.value)) this.input.value = "";
  }

  add(name) {
    const { view } = this, tag = view.recording.tags.get(name);
    if (!view.recording.signalIndex.has(name) || this.rows.size >= MOST) return false;
    if (this.rows.has(name)) return true;
    const value = element("span", { class: "value" }), said = element("small", {});
    const remove = element("button", { class: "quiet", "aria-label": `Remove ${name}`, title: "Remove", onclick: () => { this.rows.delete(name); row.remove(); this.draw(); } }, "✕");
    const hands = view.desk?.commands ? element("div", { class: "choices" }, field(tag, "Force", (given) => view.desk.ask("force", [name], [given]), () => view.desk.rights.refusal("force"), view.signal(name)),
      guarded(element("button", { "aria-label": `End the force on ${name}`, onclick: () => view.desk.ask("unforce", [name]) }, "Unforce"), () => view.desk.rights.refusal("unforce"))) : "";
    const row = element("li", {}, element("div", { class: "watch" }, element("span", { class: "what" }, name, said), value, remove), hands);
    this.rows.set(name, { tag, value, said });
    this.list.append(row);
    this.draw();
    return true;
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
