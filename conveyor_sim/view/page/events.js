// The event list: what happened around now, by kind and by words; a click jumps there.

import { lastUpTo } from "./block.js";
import { element, refill, seconds, shown, titled } from "./dom.js";

const KINDS = {
  alarms: (kind) => kind.startsWith("alarm_"),
  machines: (kind) => kind === "machine_state",
  faults: (kind) => kind.startsWith("fault_") || kind.startsWith("signal_"),
  commands: (kind) => kind.startsWith("command_") || kind.endsWith("_changed") || kind === "limit_passed",
  bottles: (kind) => kind.startsWith("bottle_"),
};
const AROUND = 60; // rows to either side of now

export class Events {
  constructor(view) {
    this.view = view;
    this.on = new Set(["alarms", "machines", "faults", "commands"]);
    if (!view.story.events.some((event) => !KINDS.bottles(event.kind))) this.on.add("bottles");
    this.words = element("input", { type: "search", placeholder: "Filter by name or text", "aria-label": "Filter events", oninput: () => this.filter() });
    const boxes = Object.keys(KINDS).map((kind) => element("label", { class: "check" },
      element("input", { type: "checkbox", checked: this.on.has(kind), value: kind, onchange: (event) => this._switch(kind, event.target.checked) }), ` ${kind}`));
    this.list = element("ol", { class: "rows", "aria-label": "Events" });
    this.root = element("section", { class: "events" }, element("h2", {}, titled("Events", view)), element("div", { class: "filters" }, this.words, ...boxes), this.list);
    this.filter();
  }

  _switch(kind, on) {
    if (on) this.on.add(kind);
    else this.on.delete(kind);
    this.filter();
  }

  filter() {
    const words = this.words.value.toLowerCase(), kinds = [...this.on].map((kind) => KINDS[kind]);
    this.found = this.view.story.events.filter((event) => kinds.some((is) => is(event.kind))
      && (!words || `${event.kind} ${event.name} ${event.text}`.toLowerCase().includes(words)));
    this.times = this.found.map((event) => event.time);
    this.drawn = null;
    this.view.touch?.();
  }

  draw() {
    const now = lastUpTo(this.times, this.view.clock.time + 1e-6);
    if (now === this.drawn) return;
    this.drawn = now;
    const from = Math.max(0, now - AROUND), rows = this.found.slice(from, now + AROUND).map((event, i) => this._row(event, from + i, now));
    refill(this.list, rows.length ? rows : [element("li", { class: "muted" }, "Nothing of this kind happened.")]);
    this.list.querySelector(".now")?.scrollIntoView({ block: "nearest" });
  }

  _row(event, place, now) {
    const { tags } = this.view.recording, state = event.kind === "machine_state" ? shown(event.value, tags.get(event.name)) : "";
    const about = event.bottle >= 0 ? `${event.name} · bottle ${event.bottle}` : event.name;
    return element("li", {}, element("button", {
      class: `event${place === now ? " now" : ""}${place > now ? " later" : ""}`, "aria-current": place === now ? "true" : null, dataset: { key: place },
      onclick: () => this.view.jump(event.time, event.name, event.bottle),
    }, element("time", {}, seconds(event.time)), element("span", { class: "what" }, element("b", {}, event.kind.replace("_", " ")), ` ${about} ${state}`, event.text && event.text !== state ? element("small", {}, event.text) : null)));
  }
}
