// SPDX-License-Identifier: Apache-2.0
// OEE tiles: production of each machine and of the line since the last reset.

import { CATEGORIES } from "./colours.js";
import { element, keyOf, titled } from "./dom.js";
import { NONE, inPercent } from "./production.js";

export class Tiles {
  constructor(view) {
    this.view = view;
    this.list = element("div", { class: "tiles" });
    this.key = element("p", { class: "key" });
    this.root = element("section", {}, element("h2", {}, titled("Production", view)), this.key, this.list);
    this.drawn = null;
  }

  // Returns the category of a machine that does not run, with its reason.
  _why(name, { category, stop_reason }) {
    const { story, clock } = this.view;
    if ([category, "none"].includes(stop_reason)) return category;
    const isOver = category === "idle" && !stop_reason.startsWith("command"); // a failure stays the reason of a commanded stop
    return `${category}: ${isOver ? story.commandedStop(name, clock.time) || `after ${stop_reason}` : stop_reason}`;
  }

  draw() {
    const { story, clock, recording } = this.view, entry = story.countersAt(clock.time);
    if (entry === this.drawn && entry !== null) return;
    this.drawn = entry;
    this.key.hidden = !entry;
    if (!entry) {
      this.list.replaceChildren(element("p", { class: "muted" }, "No counters were recorded up to here."));
      return;
    }
    const fields = recording.head.fields.counters, seen = new Set();
    this.list.replaceChildren(...entry.name.map((name, i) => {
      const row = Object.fromEntries(fields.map((field, k) => [field, entry.rows[i][k]]));
      const times = Object.keys(CATEGORIES).map((category) => [category, row[category]]).filter(([, time]) => time > 0);
      for (const [category] of times) seen.add(category);
      const all = times.reduce((sum, [, time]) => sum + time, 0);
      const bar = element("div", { class: "times", role: "img", "aria-label": times.map(([category, time]) => `${category} ${time.toFixed(0)} s`).join(", ") },
        ...times.map(([category, time]) => {
          const part = element("span", { title: `${category} ${time.toFixed(1)} s` });
          part.style.width = `${(100 * time) / all}%`;
          part.style.background = CATEGORIES[category];
          return part;
        }));
      return element("article", { class: "tile" },
        element("h3", { title: name }, name.replace(/^(machines|carousels)\//, "")),
        row.oee === null ? null : element("div", { class: "oee" }, element("strong", {}, inPercent(row.oee)), element("span", {}, "OEE")),
        element("dl", {},
          ...[["availability", inPercent(row.availability)], ["effectiveness", inPercent(row.effectiveness)], ["quality", inPercent(row.quality)],
            ["bottles", `${row.processed}`]].filter(([, value]) => value !== NONE).flatMap(([term, value]) => [element("dt", {}, term), element("dd", {}, value)])),
        all ? bar : null,
        row.stop_reason && row.category !== "running" ? element("p", { class: "muted" }, this._why(name, row)) : null);
    }));
    this.key.replaceChildren(...keyOf(Object.entries(CATEGORIES).filter(([name]) => seen.has(name)).map(([name, colour]) => [colour, name])));
  }
}
