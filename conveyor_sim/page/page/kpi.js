// SPDX-License-Identifier: Apache-2.0
// The strip of key figures at the displayed time: throughput, OEE, bottles, alarms and the bottleneck. A click shows more.

import { byId, element, seconds } from "./dom.js";
import { NONE, inPercent, lineOee, perHour, throughput } from "./production.js";
import { stateName, stateOf } from "./story.js";

const WINDOW = 60; // s over which the throughput is measured

export class Kpi {
  constructor(view) {
    this.view = view;
    this.figures = new Map();
    const figure = (name, title, tab, of) => {
      const value = element("b", {}), term = element("span", {}, name);
      const root = element("button", { title, onclick: () => view.tabs.show(tab) }, term, " ", value);
      this.figures.set(name, { value, root, of });
      return root;
    };
    byId("kpi").replaceChildren(
      figure("throughput", `Bottles that left the line in the last ${WINDOW} s, per hour`, "line", (one) => this._throughput(one)),
      figure("OEE", "OEE of the line since the last reset of its counters", "line", (one) => inPercent(lineOee(one, one.clock.time))),
      figure("bottles", "Bottles on the belts", "bottle", ({ plan }) => `${plan.frame?.bottles.length ?? NONE}`),
      figure("alarms", "Alarms that stand", "alarms", ({ story, clock }) => `${story.alarmsAt(clock.time).filter(({ stands }) => stands).length}`),
      figure("bottleneck", "Machines that limit the line", "line", (one) => this._bottleneck(one)));
  }

  _throughput(one) {
    const { time } = one.clock, { story, recording: { began } } = one, from = Math.max(began, time - WINDOW);
    // Events of a running line begin some time before the page was opened.
    const known = one.line && story.events.length && story.events[0].time > from ? story.events[0].time : from;
    return perHour(throughput(one, known, time));
  }

  _bottleneck(one) {
    const names = one.story.countersAt(one.clock.time)?.bottleneck ?? [];
    const said = names.map((name) => {
      const { state, category } = stateOf(one, name);
      return `${name.replace("machines/", "")}${state === undefined ? "" : ` · ${stateName(state, category)}`}`;
    });
    return said.join(", ") || NONE;
  }

  draw() {
    const views = this.view.plans.map(({ view }) => view);
    for (const [name, { value, root, of }] of this.figures) {
      const text = [...new Set(views.map(of))].join(" | "); // of A and B
      if (value.textContent !== text) value.textContent = text;
      if (name === "alarms") root.classList.toggle("urgent", /[1-9]/.test(text));
    }
    byId("kpi").setAttribute("aria-label", `Key figures at ${seconds(this.view.clock.time)}`);
  }
}
