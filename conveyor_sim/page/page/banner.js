// SPDX-License-Identifier: Apache-2.0
// The banner: forced signals and injected faults at the displayed time, in every view.

import { byId, element, refill, shown } from "./dom.js";
import { guarded, restrict } from "./rights.js";

const MOST = 8; // entries

export class Banner {
  constructor(view) {
    this.view = view;
    this.root = byId("banner");
    this.list = element("span", { class: "marked", role: "status" });
    const { desk } = view;
    this.end = desk?.commands ? guarded(element("button", { onclick: () => desk.ask("unforce", []) }, "End all forces"), () => desk.rights.refusal("unforce")) : "";
    this.root.replaceChildren(this.list, this.end);
  }

  draw() {
    const entries = this.view.plans.flatMap((plan) => this._of(plan.view)), key = JSON.stringify(entries);
    this.root.hidden = !entries.length;
    if (this.end) {
      this.end.hidden = !entries.some(({ word }) => word === "forced");
      restrict(this.root);
    }
    if (key === this.key) return;
    this.key = key;
    const rest = entries.length - MOST;
    refill(this.list, [element("span", { "aria-hidden": "true" }, "⚠"), ...entries.slice(0, MOST).map((entry) => this._entry(entry)), ...(rest > 0 ? [`and ${rest} more`] : [])]);
  }

  _of(view) {
    const { story, clock, letter, recording } = view, entry = (word, name, value) => ({ word, name, letter, text: shown(value, recording.tags.get(name)) });
    return [...Array.from(story.forcedAt(clock.time), (name) => entry("forced", name, view.signal(name))),
      ...Array.from(story.faultsAt(clock.time), ([name, value]) => entry("fault", name, value))];
  }

  _entry({ word, name, letter, text }) {
    const { view } = this, device = view.recording.tags.get(name)?.device;
    const show = () => {
      view.selectDevice(device);
      view.tabs.show("device");
    };
    return element("button", { class: word, title: `Show ${device}`, dataset: { key: `${letter} ${word} ${name}` }, onclick: show },
      element("b", {}, `${letter ? `${letter} ` : ""}${word}`), ` ${name} = ${text}`);
  }
}
