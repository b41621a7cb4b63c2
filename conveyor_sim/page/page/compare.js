// SPDX-License-Identifier: Apache-2.0
// Comparison of two recordings, A and B: their figures, the first difference of each kind, and all differences at the displayed time.

import { element, refill, seconds, shown } from "./dom.js";
import { NONE, alarmsRaised, inNewton, inPercent, lineOee, perHour, throughput } from "./production.js";

const TITLES = {
  commands: "First different command", signals: "First different signal", bottles: "First different bottle", seen: "First bottle more than 1 mm apart",
};
const MOST = 40; // rows
const inPoints = (share) => `${(100 * share).toFixed(1)} points`;
const signed = (text) => (/^[1-9]|^0\.\d*[1-9]/.test(text) ? `+${text}` : text.replace("-", "−"));
const APART = 1e-3; // m, least distance of bottles that are listed

export class Compare {
  constructor(view, compared) {
    Object.assign(this, { view, compared, found: [], done: false, failed: "", peaks: [null, null], peaksTo: compared.start });
    this.figures = element("table", { class: "figures" });
    this.first = element("ul", { class: "rows", "aria-label": "First differences" });
    this.bottles = element("p", {});
    this.table = element("table", {});
    this.root = element("section", { class: "plate" }, element("h2", {}, "A and B"), element("p", { class: "muted" }, `From ${seconds(compared.start)} to ${seconds(compared.end)}`), this.figures, element("h2", {}, "First differences"), this.first, element("h2", {}, "Now"), this.bottles, this.table);
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

  // Adds the largest forces of a part; null: unknown.
  addPeaks(part, share) {
    this.peaks = this.peaks.map((most, i) => (part[i] === null ? { force: null } : most && !(part[i].force > most.force) ? most : part[i]));
    this.peaksTo = this.compared.start + share * (this.compared.end - this.compared.start);
    this.view.touch();
  }

  draw() {
    this._figures();
    this._first();
    this._bottles();
    this._signals();
  }

  _figures() {
    const { start, end } = this.compared, views = this.view.plans.map(({ view }) => view);
    const isRead = this.peaksTo >= end - 1e-6, [a, b] = this.peaks.map((peak) => peak?.force ?? null);
    const rows = [
      ["throughput", perHour, perHour, ...views.map((view) => throughput(view, start, end))],
      ["OEE of the line", inPercent, inPoints, ...views.map((view) => lineOee(view, end))],
      [isRead ? "peak force" : `peak force up to ${seconds(this.peaksTo, 0)}`, inNewton, inNewton, a, b],
      ["alarms raised", String, String, ...views.map((view) => alarmsRaised(view, start, end))],
    ];
    const key = JSON.stringify(rows.map(([name, , , ...values]) => [name, values]));
    if (key === this.figuresKey) return;
    this.figuresKey = key;
    const cells = (name, write, writeChange, one, other) => [write(one), write(other), typeof one === "number" && typeof other === "number" ? signed(writeChange(other - one)) : NONE];
    refill(this.figures, [element("tr", { class: "whose" }, element("td", {}), ...["A", "B", "B − A"].map((title) => element("th", { scope: "col" }, title))),
      ...rows.map((row) => element("tr", {}, element("th", { scope: "row" }, this._named(row[0])), ...cells(...row).map((text) => element("td", {}, text))))]);
  }

  // Returns the name of a figure; of the peak force as a link to the larger one.
  _named(name) {
    const peaks = this.peaks.filter((peak) => peak?.bottle >= 0).sort((one, other) => other.force - one.force);
    if (!name.startsWith("peak") || !peaks.length) return name;
    const [{ time, bottle }] = peaks;
    return element("button", { class: "link", title: `Bottle ${bottle} at ${seconds(time)}`, dataset: { key: "peak" }, onclick: () => this.view.jump(time, "", bottle) }, name);
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
    const text = `${here.length} ${here.length === 1 ? "bottle" : "bottles"} in A, ${there.length} in B${far}`;
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
