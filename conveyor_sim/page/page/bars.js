// SPDX-License-Identifier: Apache-2.0
// State bars: states of machines over the whole time, one bar each.

import { lastUpTo } from "./block.js";
import { palette } from "./colours.js";
import { element, keyOf, seconds, sharp, short, titled } from "./dom.js";
import { stateColour, stateName, stateOf } from "./story.js";

const ROW = 38, BAR = 14, UNDER = 20; // px: height of a machine's row, of its bar, of the time axis
const LETTERS = 24; // longest name
const STATE = /^machines\/.*\/state$/;

export class Bars {
  constructor(view) {
    this.view = view;
    this.canvas = element("canvas", { class: "bars", height: 1, role: "button", tabindex: "0", onclick: (event) => this._jump(event), onkeydown: (event) => event.key === "Enter" && this._next() });
    this.key = element("p", { class: "key" });
    this.note = element("p", { class: "muted" });
    this.named();
    this.root = element("section", {}, element("h2", {}, titled("Machines", view)), this.canvas, this.key, this.note);
  }

  named() {
    const { story, recording: { head, tags } } = this.view;
    const never = head.signals.filter((name) => STATE.test(name) && Number.isFinite(tags.get(name)?.initial)).map((name) => name.replace(/\/state$/, ""));
    this.names = [...new Set([...story.machines.keys(), ...never])].filter((name) => STATE.test(`${name}/state`)).sort();
    const all = this.names.flatMap((name) => [story.initially(name), ...(story.machines.get(name) ?? [])]).filter(({ state }) => Number.isFinite(state));
    const looks = new Map(all.sort((a, b) => a.state - b.state).map(({ state, category }) => [stateName(state, category), stateColour(state, category)]));
    this.key.replaceChildren(...keyOf([...looks].map(([name, colour]) => [colour, name])));
    this.canvas.style.height = `${this.names.length * ROW + UNDER}px`;
    this.canvas.hidden = this.key.hidden = !this.names.length;
    this.note.hidden = this.view.letter === "B"; // one note for both recordings is enough
    this.note.textContent = this.names.length ? "A click on a bar jumps to that time, Enter to the next change." : "The line has no machines.";
  }

  _span() {
    const { story, recording } = this.view;
    const { head: { times, tick }, start, end } = recording, first = story.events[0]?.time ?? start;
    return [Math.min(start, times.began === undefined ? first : Math.min(first, times.began * tick)), end];
  }

  _jump(event) {
    const [from, to] = this._span(), box = this.canvas.getBoundingClientRect();
    this.view.jump(from + ((event.clientX - box.left) / box.width) * (to - from));
  }

  _next() {
    const { story, clock } = this.view, times = [...story.machines.values()].flat().map(({ time }) => time);
    const next = times.reduce((first, time) => (time > clock.time + 1e-3 ? Math.min(first, time) : first), Infinity);
    if (next < Infinity) this.view.jump(next);
  }

  draw() {
    const context = sharp(this.canvas);
    if (!context) return;
    const { story, clock } = this.view, colours = palette(), [from, to] = this._span(), width = this.canvas.clientWidth;
    const x = (time) => ((time - from) / Math.max(to - from, 1e-9)) * width, said = [];
    context.textBaseline = "middle";
    this.names.forEach((name, row) => {
      const top = row * ROW, changes = story.machines.get(name) ?? [];
      const first = changes.length ? story.initially(name) : stateOf(this.view, name);
      const all = [...(Number.isFinite(first.state) ? [{ time: from, ...first }] : []), ...changes];
      all.forEach((change, i) => {
        const end = all[i + 1]?.time ?? to;
        context.fillStyle = stateColour(change.state, change.category);
        context.fillRect(x(change.time), top + 19, Math.max(1, x(end) - x(change.time)), BAR);
      });
      const now = all[lastUpTo(all.map(({ time }) => time), clock.time + 1e-6)], text = now ? stateName(now.state, now.category) : "", plain = name.split("/").pop();
      said.push(`${plain} ${text}`);
      context.fillStyle = colours.ink;
      context.font = "12px system-ui, sans-serif";
      context.textAlign = "right";
      context.fillText(text, width, top + 9);
      context.font = "600 12px system-ui, sans-serif";
      context.textAlign = "left";
      context.fillText(short(plain, LETTERS), 0, top + 9, width - 120);
    });
    const bottom = this.names.length * ROW;
    this.names.forEach((_, row) => {
      context.fillStyle = colours.halo;
      context.fillRect(x(clock.time) - 2, row * ROW + 16, 4, BAR + 6);
      context.fillStyle = colours.ink;
      context.fillRect(x(clock.time) - 1, row * ROW + 16, 2, BAR + 6);
    });
    context.fillStyle = colours.muted;
    context.font = "11px system-ui, sans-serif";
    context.fillText(seconds(from), 0, bottom + 6);
    context.textAlign = "right";
    context.fillText(seconds(to), width, bottom + 6);
    const label = `${titled("States over time", this.view)}. Now: ${said.join(", ") || "no machine"}. Enter goes to the next change.`;
    if (this.canvas.getAttribute("aria-label") !== label) this.canvas.setAttribute("aria-label", label);
  }
}
