// Faceplates: all tags of a device as they are now; a click on a tag puts it on the trends.

import { controlsOf } from "./controls.js";
import { element, seconds, shown } from "./dom.js";

const ORDER = ["status", "actual", "counter", "alarm", "command", "setpoint", "fault"];
const TITLES = { status: "Status", actual: "Values", counter: "Counters", alarm: "Alarms", command: "Commands", setpoint: "Setpoints", fault: "Faults" };

export class Faceplate {
  constructor(view) {
    this.view = view;
    this.devices = [...new Set(view.recording.head.tags.map((tag) => tag.device).filter(Boolean))];
    this.choice = element("select", { "aria-label": "Device", onchange: () => view.selectDevice(this.choice.value) },
      ...this.devices.map((name) => element("option", { value: name }, name)));
    this.body = element("div", { class: "plate" });
    this.root = element("section", {}, element("h2", {}, "Device"), this.choice, this.body);
    this.cells = [];
    if (this.devices.length) this.show(this.devices[0]);
  }

  show(device) {
    if (!this.devices.includes(device)) return;
    this.device = device;
    this.choice.value = device;
    const { recording } = this.view, tags = recording.head.tags.filter((tag) => tag.device === device);
    this.cells = [];
    const groups = ORDER.filter((role) => tags.some((tag) => tag.role === role)).map((role) => element("div", {},
      element("h3", {}, TITLES[role]),
      element("table", {}, ...tags.filter((tag) => tag.role === role).flatMap((tag) => this._row(tag, device)))));
    this.body.replaceChildren(element("p", { class: "muted" }, tags[0]?.class?.replace("_", " ") ?? ""), ...groups);
    this.draw();
  }

  _row(tag, device) {
    const { recording } = this.view, signal = recording.signalIndex.get(tag.name), command = recording.head.commands.indexOf(tag.name);
    const value = element("td", { class: "value" }), note = element("small", {});
    this.cells.push({ tag, signal, command, value, note });
    const name = tag.name.slice(device.length + 1) || tag.name;
    const head = signal === undefined ? name : element("button", { class: "link", title: "Put on the trends", onclick: () => this.view.trends.add(tag.name) }, name);
    const watch = signal === undefined || !this.view.watch ? "" : element("button", { class: "quiet", title: "Put on the watch table", "aria-label": `Watch ${tag.name}`, onclick: () => this.view.watch.add(tag.name) }, "◎");
    const row = element("tr", { title: tag.description ?? "" }, element("th", { scope: "row" }, head, watch, note), value), hands = controlsOf(tag, this.view);
    return hands ? [row, element("tr", { class: "hands" }, element("td", { colspan: "2" }, hands))] : [row];
  }

  draw() {
    const { clock, recording, story } = this.view, forced = story.forcedAt(clock.time);
    for (const { tag, signal, command, value, note } of this.cells) {
      let now = tag.initial, said = "";
      if (signal !== undefined) {
        now = recording.at("signals", signal, clock.time);
        if (forced.has(tag.name)) said = "forced";
      } else if (command >= 0) {
        const read = story.readBackAt(command, clock.time);
        if (read) [now, said] = [read.value, `by ${read.writer} since ${seconds(read.since)}`];
      } else if (tag.role === "fault") now = this._fault(tag.name) ?? tag.initial;
      const text = shown(now, tag);
      if (value.textContent !== text) value.textContent = text;
      if (note.textContent !== said) note.textContent = said;
      value.classList.toggle("on", tag.kind === "bool" && now === 1);
      value.classList.toggle("forced", said === "forced");
    }
  }

  _fault(name) {
    let now;
    for (const event of this.view.story.events) {
      if (event.time > this.view.clock.time + 1e-6) break;
      if (event.name === name && event.kind === "fault_injected") now = event.value;
      if (event.name === name && event.kind === "fault_cleared") now = 0;
    }
    return now;
  }
}
