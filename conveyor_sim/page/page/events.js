// SPDX-License-Identifier: Apache-2.0
// The event list: events around the displayed time, by kind and words; a click jumps to an event.

import { lastUpTo } from "./block.js";
import { element, refill, seconds, shown, titled } from "./dom.js";

const KINDS = {
  alarms: (kind) => kind.startsWith("alarm_"),
  machines: (kind) => kind === "machine_state",
  faults: (kind) => kind.startsWith("fault_") || kind.startsWith("signal_"),
  commands: (kind) => kind.startsWith("command_") || kind.endsWith("_changed") || kind === "limit_passed",
  bottles: (kind) => kind.startsWith("bottle_"),
};
const titleOf = (event) => event.kind.replaceAll("_", " ");
const AROUND = 60; // rows before and after the displayed time

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
    const { story } = this.view, said = (event) => `${titleOf(event)} ${event.name} ${event.text}`.toLowerCase();
    this.found = story.events.filter((event) => kinds.some((is) => is(event.kind)) && (words ? said(event).includes(words) : !story.repeats(event)));
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
    const { story, recording: { tags } } = this.view, isState = event.kind === "machine_state" && event.name.endsWith("/state");
    const plain = event.kind === "machine_state" ? shown(event.value, tags.get(event.name)) : "", state = isState ? story.whyOf(event) : plain;
    const name = isState ? event.name.replace(/\/state$/, "") : event.name.replace(/^alarms\//, "");
    const about = event.bottle >= 0 ? `${name} · bottle ${event.bottle}` : name, text = event.text === plain ? "" : event.text;
    return element("li", {}, element("button", {
      class: `event${place === now ? " now" : ""}${place > now ? " later" : ""}`, "aria-current": place === now ? "true" : null, dataset: { key: place },
      onclick: () => this.view.jump(event.time, event.name, event.bottle),
    }, element("time", {}, seconds(event.time)), element("span", { class: "what" }, element("b", {}, titleOf(event)), ` ${about} ${state}`, text ? element("small", {}, text) : null)));
  }
}
