// SPDX-License-Identifier: Apache-2.0
// The alarm list: alarms that are not normal now, with the first-out marked; a click jumps to the place and time of an alarm.

import { controlsOfAlarm } from "./controls.js";
import { element, refill, seconds, titled } from "./dom.js";
import { restrict } from "./rights.js";
import { ALARM_STATES } from "./story.js";

// Lists of alarms with the same key look the same.
const keyOfAlarms = (alarms) => alarms.map((alarm) => `${alarm.number} ${alarm.state} ${alarm.since} ${alarm.firstOut}`).join("|");

function row(alarm, view) {
  return element("li", {},
    element("button", { class: `alarm ${alarm.stands ? alarm.alarm_class || "error" : "gone"}`, dataset: { key: alarm.number }, onclick: () => view.jump(alarm.since, alarm.tag) },
      element("span", { class: "icon", "aria-hidden": "true" }, alarm.stands ? (alarm.alarm_class === "message" ? "●" : "▲") : "○"),
      element("span", { class: "what" }, element("b", {}, alarm.id), ` ${alarm.text}`,
        element("small", {}, `${ALARM_STATES[alarm.state]}${alarm.by ? ` by ${alarm.by}` : ""} · since ${seconds(alarm.since)} · priority ${alarm.priority}`)),
      alarm.firstOut ? element("span", { class: "badge" }, "first out") : null), controlsOfAlarm(alarm, view));
}

// Renews a list of alarms if it has changed. key: key of the present list. Returns the new key.
export function fillAlarms(list, alarms, view, nothing, key) {
  const now = keyOfAlarms(alarms);
  if (now !== key) refill(list, alarms.length ? alarms.map((alarm) => row(alarm, view)) : [element("li", { class: "muted" }, nothing)]);
  return now;
}

export class Alarms {
  constructor(view) {
    this.view = view;
    this.list = element("ul", { class: "rows", "aria-label": titled("Alarms", view) });
    this.note = element("p", { class: "reason", hidden: true });
    this.root = element("section", {}, element("h2", {}, titled("Alarms", view)), this.note, this.list);
    this.drawn = null;
  }

  draw() {
    const { story, clock } = this.view, alarms = story.alarmsAt(clock.time);
    this.drawn = fillAlarms(this.list, alarms, this.view, "All alarms are normal.", this.drawn);
    restrict(this.list, this.note);
    this.view.badge("alarms", alarms.filter((alarm) => alarm.stands).length);
  }
}
