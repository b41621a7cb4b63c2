// SPDX-License-Identifier: Apache-2.0
// Manual inputs of tags: fields and buttons for commands, modes, faults and forces.

import { element } from "./dom.js";
import { guarded } from "./rights.js";

function textsOf(tag) {
  return Array.from((tag.texts ?? "").matchAll(/(-?\d+) (.*?)(?=, -?\d+ |$)/g), ([, number, text]) => [number, text]);
}

// Returns a field for a value of a tag, or two buttons. give: called with a number. why: returns the reason for which a
// number would be refused. now: initial choice.
export function field(tag, label, give, why, now, texts = textsOf(tag)) {
  if (tag.kind === "bool") {
    const button = (text, value) => guarded(element("button", { onclick: () => give(value), "aria-label": `${label} ${tag.name} ${text}` }, `${label} ${text}`), () => why(value));
    return element("span", { class: "field" }, button("on", 1), button("off", 0));
  }
  const send = () => {
    if (input.value !== "") give(+input.value);
  };
  const option = ([value, text]) => guarded(element("option", { value, selected: +value === now }, text), () => why(+value));
  const input = texts.length
    ? guarded(element("select", { "aria-label": `${label} ${tag.name}` }, ...texts.map(option)), () => (texts.some(([value]) => !why(+value)) ? "" : why(+texts[0][0])))
    : guarded(element("input", { type: "number", step: tag.kind === "number" ? "any" : "1", "aria-label": `${label} ${tag.name}`, placeholder: limits(tag), onkeydown: (event) => event.key === "Enter" && send() }), () => why());
  const set = guarded(element("button", { onclick: send, "aria-label": `${label} ${tag.name} now` }, label), () => why(input.value === "" ? undefined : +input.value));
  return element("span", { class: "field" }, input, set);
}

function limits(tag) {
  return Number.isFinite(tag.min) && Number.isFinite(tag.max) ? `${tag.min} to ${tag.max}` : "";
}

// Returns the controls of a faceplate for a tag of a running line; null: none.
export function controlsOf(tag, view) {
  const { desk, recording, story, clock } = view;
  if (!desk?.commands) return null;
  const of = (label, what, name, now, texts) => field(tag, label, (value) => desk.ask(what, [name], [value]), (value) => desk.rights.refusal(what, [name], [value]), now, texts);
  const command = recording.head.commands.indexOf(tag.name);
  if (command >= 0) return of("Set", "set", tag.name, story.readBackAt(command, clock.time)?.value);
  if (tag.role === "fault") return of("Inject", "inject", tag.name);
  if (!tag.device || tag.name !== `${tag.device}/mode`) return null;
  return of("Set", "mode", tag.device, view.signal(tag.name), Object.entries(desk.rights.rights.texts));
}

const CAN = {
  acknowledge: [1, 3, 4], confirm: [9, 10, 11], reset: [5], shelve: [1, 2, 3, 4, 5, 9, 10, 11], unshelve: [6],
};
const WORDS = { acknowledge: "Acknowledge", confirm: "Confirm", reset: "Reset", shelve: "Shelve 1 min", unshelve: "Unshelve" };
const SHELVED = 60; // shelving time, s

// Returns the controls for an alarm in a state.
export function controlsOfAlarm(alarm, view) {
  const { desk } = view;
  if (!desk?.commands) return null;
  const buttons = Object.keys(CAN).filter((what) => CAN[what].includes(alarm.state)).map((what) => guarded(element("button",
    { "aria-label": `${WORDS[what]} ${alarm.id}`, onclick: () => desk.ask(what, [alarm.id], what === "shelve" ? [SHELVED] : []) }, WORDS[what]), () => desk.rights.refusal(what)));
  return buttons.length ? element("div", { class: "choices" }, ...buttons) : null;
}
