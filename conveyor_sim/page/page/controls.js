// Manual inputs of tags: fields and buttons for commands, modes, faults and forces.

import { element } from "./dom.js";

const MODES = { 1: "Automatic", 2: "Maintenance", 3: "Manual" };

function textsOf(tag) {
  return Array.from((tag.texts ?? "").matchAll(/(-?\d+) (.*?)(?=, -?\d+ |$)/g), ([, number, text]) => [number, text]);
}

// Returns a field for a value of a tag, or two buttons. give: called with a number. now: initial choice.
export function field(tag, label, give, now, texts = textsOf(tag)) {
  if (tag.kind === "bool") {
    const button = (text, value) => element("button", { onclick: () => give(value), "aria-label": `${label} ${tag.name} ${text}` }, `${label} ${text}`);
    return element("span", { class: "field" }, button("on", 1), button("off", 0));
  }
  const send = () => {
    if (input.value !== "") give(+input.value);
  };
  const input = texts.length
    ? element("select", { "aria-label": `${label} ${tag.name}` }, ...texts.map(([value, text]) => element("option", { value, selected: +value === now }, text)))
    : element("input", { type: "number", step: tag.kind === "number" ? "any" : "1", "aria-label": `${label} ${tag.name}`, placeholder: limits(tag), onkeydown: (event) => event.key === "Enter" && send() });
  return element("span", { class: "field" }, input, element("button", { onclick: send, "aria-label": `${label} ${tag.name} now` }, label));
}

function limits(tag) {
  return Number.isFinite(tag.min) && Number.isFinite(tag.max) ? `${tag.min} to ${tag.max}` : "";
}

// Returns the controls of a faceplate for a tag of a running line; null: none.
export function controlsOf(tag, view) {
  const { desk, recording, story, clock } = view;
  if (!desk?.commands) return null;
  const command = recording.head.commands.indexOf(tag.name);
  if (command >= 0) return field(tag, "Set", (value) => desk.ask("set", [tag.name], [value]), story.readBackAt(command, clock.time)?.value);
  if (tag.role === "fault") return field(tag, "Inject", (value) => desk.ask("inject", [tag.name], [value]));
  if (!tag.device || tag.name !== `${tag.device}/mode`) return null;
  return field(tag, "Set", (value) => desk.ask("mode", [tag.device], [value]), view.signal(tag.name), Object.entries(MODES));
}

const CAN = { acknowledge: [1, 3, 4], reset: [5], shelve: [1, 2, 3, 4, 5], unshelve: [6] };
const WORDS = { acknowledge: "Acknowledge", reset: "Reset", shelve: "Shelve 1 min", unshelve: "Unshelve" };
const SHELVED = 60; // shelving time, s

// Returns the controls for an alarm in a state.
export function controlsOfAlarm(alarm, view) {
  if (!view.desk?.commands) return null;
  const buttons = Object.keys(CAN).filter((what) => CAN[what].includes(alarm.state)).map((what) => element("button",
    { "aria-label": `${WORDS[what]} ${alarm.id}`, onclick: () => view.desk.ask(what, [alarm.id], what === "shelve" ? [SHELVED] : []) }, WORDS[what]));
  return buttons.length ? element("div", { class: "choices" }, ...buttons) : null;
}
