// State bars: what machines do over the whole time, a bar each.

import { lastUpTo } from "./block.js";
import { palette } from "./colours.js";
import { stateColour } from "./devices.js";
import { element, keyOf, sharp, short, titled } from "./dom.js";
import { stateName } from "./story.js";

const ROW = 26, NAME = 96, LETTERS = 14; // of a name
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
    this.names = [...new Set([...story.machines.keys(), ...never])].sort();
    const states = [...story.machines.values()].flat().map(({ state }) => state);
    const initial = this.names.map((name) => tags.get(`${name}/state`)?.initial).filter(Number.isFinite);
    this.key.replaceChildren(...keyOf([...new Set([...states, ...initial])].sort((a, b) => a - b).map((state) => [stateColour(state), stateName(state)])));
    this.canvas.setAttribute("aria-label", `${titled("States over time", this.view)} of ${this.names.join(", ") || "no machine"}. Enter goes to the next change.`);
    this.canvas.style.height = `${this.names.length * ROW + 4}px`;
    this.canvas.hidden = this.key.hidden = !this.names.length;
    this.note.hidden = this.view.letter === "B"; // said once
    this.note.textContent = this.names.length ? "A click on a bar jumps to that time, Enter to the next change." : "There is no machine.";
  }

  _span() {
    const { story, recording } = this.view;
    return [Math.min(recording.start, story.events[0]?.time ?? recording.start), recording.end];
  }

  _jump(event) {
    const [from, to] = this._span(), box = this.canvas.getBoundingClientRect();
    const share = (event.clientX - box.left - NAME) / (box.width - NAME);
    if (share >= 0) this.view.jump(from + share * (to - from));
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
    const x = (time) => NAME + ((time - from) / Math.max(to - from, 1e-9)) * (width - NAME);
    context.font = "12px system-ui, sans-serif";
    context.textBaseline = "middle";
    this.names.forEach((name, row) => {
      const changes = story.machines.get(name) ?? [], top = row * ROW + 4;
      context.fillStyle = colours.ink;
      context.fillText(short(name.split("/").pop(), LETTERS), 0, top + 9, NAME - 6);
      const initial = changes.length ? this.view.recording.tags.get(`${name}/state`)?.initial : this.view.signal(`${name}/state`);
      const all = initial === undefined || initial === null ? changes : [{ time: from, state: initial }, ...changes];
      all.forEach((change, i) => {
        const end = all[i + 1]?.time ?? to;
        context.fillStyle = stateColour(change.state);
        context.fillRect(x(change.time), top, Math.max(1, x(end) - x(change.time)), 18);
      });
      const now = all[lastUpTo(all.map(({ time }) => time), clock.time)];
      if (now) {
        const text = stateName(now.state);
        context.fillStyle = colours.halo;
        context.globalAlpha = 0.85;
        context.fillRect(NAME + 4, top + 2, context.measureText(text).width + 8, 14);
        context.globalAlpha = 1;
        context.fillStyle = colours.ink;
        context.fillText(text, NAME + 8, top + 9.5);
      }
    });
    context.fillStyle = colours.ink;
    context.fillRect(x(clock.time) - 1, 0, 2, this.names.length * ROW);
  }
}
