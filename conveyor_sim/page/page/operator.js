// SPDX-License-Identifier: Apache-2.0
// The operator panel of a line, beside the plan. On the page of a running line an operator uses it; each state has its
// own shape and text, so that colours are never needed to tell states apart.

import { byId, element, shown } from "./dom.js";
import { guarded, restrict } from "./rights.js";

const PRESSING_KEYS = [" ", "Enter"];

export class OperatorPanel {
  constructor(view) {
    this.view = view;
    const { panel = [] } = view.recording.head;
    this.note = element("p", { class: "reason", hidden: true });
    this.updates = [];
    this.root = byId("operator");
    this.root.hidden = !panel.length;
    if (panel.length) this.root.append(element("h2", {}, "Panel"), element("div", { class: "board" }, ...panel.map((part) => this._part(part))), this.note);
  }

  draw() {
    if (this.root.hidden) return;
    for (const update of this.updates) update();
    if (this.view.desk?.commands) restrict(this.root, this.note);
  }

  _part(part) {
    const make = { button: this._button, selector: this._selector, emergency_stop: this._stop, lamp: this._lamp, horn: this._lamp, stack_light: this._stack, numeric: this._numeric }[part.kind];
    return element("div", { class: `part ${part.kind}`, dataset: { part: part.name } }, element("span", { class: "plate_label" }, part.label), ...make.call(this, part));
  }

  // Returns the value of a signal or command, by default at the displayed time.
  _value(name, time = this.view.clock.time) {
    const { recording, story } = this.view, signal = recording.signal(name, time);
    if (signal !== undefined) return signal;
    return story.readBackAt(recording.head.commands.indexOf(name), time)?.value ?? recording.tags.get(name)?.initial;
  }

  _give(tag, value) {
    return this.view.desk.ask("set", [tag], [value]);
  }

  // Returns a control that is disabled on the page of a recording, and while the user may not use the panel.
  _control(control, tag) {
    if (!this.view.desk?.commands) {
      control.disabled = true;
      return control;
    }
    return guarded(control, () => this.view.desk.rights.refusal("set", [tag], [1]));
  }

  // Returns a small text for a state.
  _state(text) {
    const state = element("small", { class: "state" });
    this.updates.push(() => {
      const now = text();
      if (state.textContent !== now) state.textContent = now;
    });
    return state;
  }

  _button({ name, label, contact, action, colour }) {
    const tag = `panel/${name}/${action === "momentary" ? "press" : "pressed"}`, button = element("button", { class: "push", "aria-label": label, dataset: { colour } });
    const closed = () => this._value(`panel/${name}/contact`) === 1, isPressed = () => closed() === (contact === "NO");
    if (action === "momentary") this._hold(button, tag);
    else button.addEventListener("click", () => this._give(tag, this._value(tag, this.view.recording.end) ? 0 : 1));
    this.updates.push(() => button.setAttribute("aria-pressed", isPressed()));
    return [this._control(button, tag), this._state(() => (isPressed() ? "pressed" : "released"))];
  }

  // Makes a button that is pressed while it is held, by pointer or key.
  _hold(button, tag) {
    let held = false;
    const set = (down) => {
      if (held === down) return;
      held = down;
      this._give(tag, down ? 1 : 0);
    };
    button.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      button.setPointerCapture(event.pointerId);
      set(true);
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) button.addEventListener(end, () => set(false));
    button.addEventListener("keydown", (event) => {
      if (!PRESSING_KEYS.includes(event.key)) return;
      event.preventDefault();
      set(true);
    });
    button.addEventListener("keyup", (event) => {
      if (!PRESSING_KEYS.includes(event.key)) return;
      event.preventDefault();
      set(false);
    });
    button.addEventListener("click", (event) => {
      if (event.detail) return; // assistive technology clicks without pointer or key
      set(true);
      set(false);
    });
    button.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  _selector({ name, label, positions }) {
    const tag = `panel/${name}/turn`, now = () => this._value(`panel/${name}/position`);
    const knob = element("div", { class: "knob", "aria-hidden": "true" }, element("i"));
    const buttons = positions.map((position, i) => this._control(element("button", { onclick: () => this._give(tag, i), "aria-label": `${label}: ${position}` }, position), tag));
    this.updates.push(() => {
      knob.style.transform = `rotate(${positions.length > 1 ? -50 + (100 * (now() ?? 0)) / (positions.length - 1) : 0}deg)`;
      buttons.forEach((button, i) => button.setAttribute("aria-pressed", now() === i));
    });
    return [knob, element("div", { class: "positions", role: "group", "aria-label": label }, ...buttons)];
  }

  _stop({ name, label }) {
    const tag = `panel/${name}/press`, latched = () => this._value(`panel/${name}/contact`) === 0;
    const button = this._control(element("button", { class: "mushroom", "aria-label": `STOP: ${label}`, onclick: () => this._give(tag, 1) }, element("b", {}, "STOP")), tag);
    const reset = this._control(element("button", { "aria-label": `Reset ${label}`, onclick: () => this._give(`panel/${name}/reset`, 1) }, "⟳ Reset"), `panel/${name}/reset`);
    this.updates.push(() => {
      button.setAttribute("aria-pressed", latched());
      reset.hidden = !latched();
    });
    return [button, this._state(() => (latched() ? "✕ latched" : "released")), reset];
  }

  _light(tag, colour, text) {
    const light = element("span", { class: "light", dataset: { colour }, role: "img" });
    this.updates.push(() => {
      const on = this._value(tag) === 1, said = text(on);
      light.classList.toggle("lit", on);
      if (light.getAttribute("aria-label") !== said) light.setAttribute("aria-label", said);
    });
    return light;
  }

  _lamp({ name, label, kind, colour }) {
    const tag = `panel/${name}/on`, words = kind === "horn" ? ["silent", "sounds"] : ["off", "on"];
    const word = () => words[+(this._value(tag) === 1)];
    return [this._light(tag, kind === "horn" ? "horn" : colour, (on) => `${label} ${words[+on]}`), this._state(word)];
  }

  _stack({ name, label, lights }) {
    return [element("div", { class: "stack" }, ...lights.map((colour) => {
      const tag = `panel/${name}/${colour}`;
      return element("div", { class: "segment" }, this._light(tag, colour, (on) => `${label} ${colour} ${on ? "on" : "off"}`), this._state(() => `${colour} ${this._value(tag) === 1 ? "on" : "off"}`));
    }))];
  }

  _numeric({ name, label, written_by: by }) {
    const tag = this.view.recording.tags.get(`panel/${name}/value`), value = element("output", { class: "display", "aria-label": label });
    this.updates.push(() => {
      const now = shown(this._value(tag.name), tag);
      if (value.textContent !== now) value.textContent = now;
    });
    if (by === "controller") return [value];
    const set = `panel/${name}/set`, send = () => input.value !== "" && this._give(set, +input.value);
    const input = this._control(element("input", { type: "number", step: "any", placeholder: `${tag.min} to ${tag.max}`, "aria-label": `${label}, ${tag.min} to ${tag.max} ${tag.unit}`, onkeydown: (event) => event.key === "Enter" && send() }), set);
    return [value, element("span", { class: "field" }, input, this._control(element("button", { onclick: send, "aria-label": `Enter ${label}` }, "Set"), set))];
  }
}
