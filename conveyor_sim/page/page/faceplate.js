// SPDX-License-Identifier: Apache-2.0
// Faceplates: present values of all tags of a device, of A and B if two recordings are shown; a click adds a tag to the trends.

import { fillAlarms } from "./alarms.js";
import { controlsOf } from "./controls.js";
import { element, seconds, shown, titled, warn } from "./dom.js";
import { restrict } from "./rights.js";
import { EXECUTE } from "./story.js";

const ORDER = ["status", "actual", "counter", "alarm", "panel", "command", "setpoint", "fault"];
const TITLES = { status: "Status", actual: "Values", counter: "Counters", alarm: "Alarm counts", panel: "Panel", command: "Commands", setpoint: "Setpoints", fault: "Faults" };

export class Faceplate {
  constructor(view) {
    this.view = view;
    this.views = view.plans.map((plan) => plan.view);
    this.devices = [...new Set(view.recording.head.tags.filter(({ role }) => ORDER.includes(role)).map((tag) => tag.device).filter(Boolean))];
    this.choice = element("select", { "aria-label": "Device", onchange: () => view.selectDevice(this.choice.value) },
      ...this.devices.map((name) => element("option", { value: name }, name)));
    this.body = element("div", { class: "plate" });
    this.root = element("section", {}, element("h2", {}, "Device"), this.choice, this.body);
    this.rows = this.alarms = this.groups = [];
    this.count = element("span", { class: "badge" });
    if (this.devices.length) this.show(this.devices[0]);
  }

  show(device) {
    if (!this.devices.includes(device)) return;
    this.device = device;
    this.choice.value = device;
    const { recording } = this.view, tags = recording.head.tags.filter((tag) => tag.device === device);
    this.rows = [];
    this.groups = ORDER.filter((role) => tags.some((tag) => tag.role === role)).map((role) => {
      const note = element("p", { class: "reason", hidden: true });
      return { note, root: element("div", {}, element("h3", {}, TITLES[role]), note,
        element("table", {}, ...this._whose(), ...tags.filter((tag) => tag.role === role).flatMap((tag) => this._row(tag, device)))) };
    });
    this.alarms = this.views.map((view) => ({ view, key: null, list: element("ul", { class: "rows", "aria-label": titled(`Alarms of ${device}`, view) }) }));
    const alarms = this.alarms.map(({ view, list }) => element("div", {}, element("h3", {}, titled("Alarms", view)), list));
    this.count = element("span", { class: "badge" });
    // The alarms are below, so that fields do not move when an alarm comes.
    this.body.replaceChildren(element("p", { class: "kind" }, tags[0]?.class?.replaceAll("_", " ") ?? "", this.count), ...this._moves(device), ...this.groups.map(({ root }) => root), ...alarms);
    this.draw();
  }

  // Returns a link from a belt to the named drive that moves it, and links from such a drive to its belts.
  _moves(device) {
    const { drives } = this.view.recording.head, drive = drives[device], belts = Object.keys(drives).filter((belt) => drives[belt] === device);
    const linked = drive ? [drive] : belts;
    if (!linked.length) return [];
    const links = linked.map((name) => element("button", { class: "link", onclick: () => this.view.selectDevice(name) }, name));
    return [element("p", { class: "moves" }, drive ? "Moved by " : "Moves ", ...links.flatMap((link, i) => (i ? [", ", link] : [link])))];
  }

  // Titles of the columns, if two recordings are shown.
  _whose() {
    return this.views.length < 2 ? [] : [element("tr", { class: "whose" }, element("td", {}), ...this.views.map(({ letter }) => element("th", { scope: "col" }, letter)))];
  }

  _row(tag, device) {
    const signal = this.view.recording.signalIndex.get(tag.name), note = element("small", {});
    const cells = this.views.map((view) => {
      const { recording: { signalIndex, head } } = view, value = element("td", { class: "value" });
      return { view, value, signal: signalIndex.get(tag.name), command: head.commands.indexOf(tag.name) };
    });
    const hands = controlsOf(tag, this.view), choice = hands?.querySelector("select");
    this.rows.push({ tag, cells, note, choice });
    const name = tag.name.slice(device.length + 1) || tag.name;
    const head = signal === undefined ? name : element("button", { class: "link", title: "Put on the trends", onclick: () => this.view.trends.add(tag.name) }, name);
    const watch = signal === undefined || !this.view.watch ? "" : element("button", { class: "quiet", title: "Put on the watch table", "aria-label": `Watch ${tag.name}`, onclick: () => this._watch(tag.name) }, "◎");
    const row = element("tr", { title: tag.description ?? "" }, element("th", { scope: "row" }, head, watch, note), ...cells.map(({ value }) => value));
    return hands ? [row, element("tr", { class: "hands" }, element("td", { colspan: "2" }, hands))] : [row];
  }

  _watch(name) {
    const refused = this.view.watch.add(name);
    if (refused) warn(refused);
  }

  draw() {
    const { time } = this.view.clock, marked = new Map(this.views.map((view) => [view, { forced: view.story.forcedAt(time), faults: view.story.faultsAt(time) }]));
    const isOurs = ({ tag }) => this.device === "alarms" || tag === this.device || tag.startsWith(`${this.device}/`);
    let count = 0;
    for (const one of this.alarms) {
      const alarms = one.view.story.alarmsAt(time).filter(isOurs);
      one.key = fillAlarms(one.list, alarms, one.view, "None", one.key);
      count += alarms.filter(({ stands }) => stands).length;
    }
    this.count.hidden = !count;
    const badge = count === 1 ? "▲ 1 alarm" : `▲ ${count} alarms`;
    if (this.count.textContent !== badge) this.count.textContent = badge;
    for (const row of this.rows) {
      const { tag, cells, note, choice } = row;
      const notes = cells.map((cell) => {
        const [now, said] = this._now(tag, cell, marked.get(cell.view)), text = shown(now, tag), { value } = cell;
        if (choice && Number.isFinite(now) && now !== row.chosen && choice !== document.activeElement) choice.value = row.chosen = now; // set by any writer
        if (value.textContent !== text) value.textContent = text;
        const isOn = tag.kind === "bool" && now === 1, isBad = tag.role === "fault" || tag.name.endsWith("/fault");
        value.classList.toggle("on", isOn);
        value.classList.toggle("bad", isOn && isBad);
        value.classList.toggle("forced", said === "forced");
        return said;
      });
      const isOne = notes.every((said) => said === notes[0]);
      const said = isOne ? notes[0] : notes.map((one, i) => (one ? `${this.views[i].letter}: ${one}` : "")).filter(Boolean).join(", ");
      if (note.textContent !== said) note.textContent = said;
    }
    for (const { root, note } of this.groups) restrict(root, note);
    for (const { list } of this.alarms) restrict(list);
  }

  // Returns the value of a tag in a recording, and a remark on it.
  _now(tag, { view: { recording, story, clock }, signal, command }, { forced, faults }) {
    if (signal !== undefined) {
      const isPast = tag.name.endsWith("/stop_reason") && recording.signal(tag.name.replace(/stop_reason$/, "state"), clock.time) === EXECUTE;
      return [recording.at("signals", signal, clock.time), forced.has(tag.name) ? "forced" : isPast ? "of the last stop" : ""];
    }
    if (command >= 0) {
      const read = story.readBackAt(command, clock.time);
      return read ? [read.value, `by ${read.writer} since ${seconds(read.since)}`] : [tag.initial, ""];
    }
    if (!recording.tags.has(tag.name)) return [null, ""];
    return [tag.role === "fault" ? faults.get(tag.name) ?? 0 : tag.initial, ""];
  }
}
