// Differences of two recordings, A and B: the first of each kind, and all differences at the displayed time.

import { element, refill, seconds, shown } from "./dom.js";

const TITLES = {
  commands: "First different command", signals: "First different signal", bottles: "First different bottle", seen: "First bottle more than 1 mm apart",
};
const MOST = 40; // rows
const APART = 1e-3; // m, least distance of bottles that are listed

export class Compare {
  constructor(view, compared) {
    Object.assign(this, { view, compared, found: [], done: false, failed: "" });
    this.first = element("ul", { class: "rows", "aria-label": "First differences" });
    this.bottles = element("p", {});
    this.table = element("table", {});
    this.root = element("section", { class: "plate" }, element("h2", {}, "First differences"), this.first, element("h2", {}, "Now"), this.bottles, this.table);
    this.key = null;
  }

  // Adds the differences of one part: the first of each kind.
  add(part) {
    for (const one of part) if (!this.found.some(({ kind }) => kind === one.kind)) this.found.push(one);
    this.found.sort((a, b) => a.tick - b.tick);
  }

  get complete() {
    return this.found.length === Object.keys(TITLES).length;
  }

  marks() {
    return this.found.map(({ kind, time, texts }) => ({ time, kind: "difference", text: `${TITLES[kind].toLowerCase()}: ${texts[0]}` }));
  }

  words() {
    const [first] = this.found, { end, exact } = this.compared;
    if (first) return `A and B first differ at ${seconds(first.time)}: ${first.texts[0]}`;
    return this.done ? `A and B are equal up to ${seconds(end)}${exact ? ", bit for bit" : ""}` : "";
  }

  draw() {
    this._first();
    this._bottles();
    this._signals();
  }

  _first() {
    const key = `${this.found.map(({ tick }) => tick).join()} ${this.done} ${this.failed}`;
    if (key === this.key) return;
    this.key = key;
    const rows = this.found.map(({ kind, time, texts, bottle }) => element("li", {},
      element("button", { class: "first", dataset: { key: kind }, onclick: () => this.view.jump(time, "", bottle ?? -1) },
        element("time", {}, seconds(time)),
        element("span", { class: "what" }, element("b", {}, TITLES[kind]), ...texts.map((text) => element("small", {}, text))))));
    const nothing = this.failed || (this.done ? this.words() : "Searching for the first difference …");
    refill(this.first, rows.length ? rows : [element("li", { class: "muted" }, nothing)]);
  }

  _bottles() {
    const { view } = this, here = view.plan.frame?.bottles ?? [], there = view.rival.plan.frame?.bottles ?? [];
    let apart = 0, most = 0, worst = null;
    for (const bottle of here) {
      const far = view.apart(bottle);
      if (far > APART && far < Infinity) apart += 1;
      if (far > most && far < Infinity) [most, worst] = [far, bottle.id];
    }
    const far = apart ? `; ${apart} more than 1 mm apart, bottle ${worst} most, ${(1000 * most).toFixed(1)} mm` : "";
    const text = `${here.length} bottles in A, ${there.length} in B${far}`;
    if (this.bottles.textContent !== text) this.bottles.textContent = text;
  }

  _signals() {
    const { view } = this, { clock, recording, rival: { recording: other } } = view, rows = [];
    let more = 0;
    recording.head.signals.forEach((name, column) => {
      const there = other.signalIndex.get(name);
      if (there === undefined) return;
      const a = recording.at("signals", column, clock.time), b = other.at("signals", there, clock.time);
      if (a === undefined || b === undefined || Object.is(a, b) || a === b) return;
      if (rows.length >= MOST) more += 1;
      else rows.push([name, a, b]);
    });
    const tags = recording.tags;
    const written = JSON.stringify([rows, more]);
    if (written === this.written) return;
    this.written = written;
    refill(this.table, [
      element("tr", {}, element("th", {}, rows.length ? "signal" : "No signal differs."), element("td", {}, rows.length ? "A" : ""), element("td", {}, rows.length ? "B" : "")),
      ...rows.map(([name, a, b]) => element("tr", {}, element("th", { scope: "row" }, element("button", { class: "link", title: "Put on the trends", dataset: { key: name }, onclick: () => view.trends.add(name) }, name)),
        element("td", {}, shown(a, tags.get(name))), element("td", {}, shown(b, tags.get(name))))),
      ...(more ? [element("tr", {}, element("th", { class: "muted" }, `and ${more} more`))] : [])]);
  }
}
