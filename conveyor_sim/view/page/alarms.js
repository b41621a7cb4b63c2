// The alarm list: what is not normal now, the first-out marked; a click jumps to where and when it came.

import { controlsOfAlarm } from "./controls.js";
import { element, refill, seconds, titled } from "./dom.js";
import { ALARM_STATES } from "./story.js";

export class Alarms {
  constructor(view) {
    this.view = view;
    this.list = element("ul", { class: "rows", "aria-label": titled("Alarms", view) });
    this.root = element("section", {}, element("h2", {}, titled("Alarms", view)), this.list);
    this.drawn = null;
  }

  draw() {
    const { story, clock } = this.view, alarms = story.alarmsAt(clock.time);
    const key = alarms.map((alarm) => `${alarm.number} ${alarm.state} ${alarm.since} ${alarm.firstOut}`).join("|");
    if (key === this.drawn) return;
    this.drawn = key;
    const rows = alarms.map((alarm) => element("li", {},
      element("button", { class: `alarm ${alarm.stands ? alarm.alarm_class || "error" : "gone"}`, dataset: { key: alarm.number }, onclick: () => this.view.jump(alarm.since, alarm.tag) },
        element("span", { class: "icon", "aria-hidden": "true" }, alarm.stands ? (alarm.alarm_class === "message" ? "●" : "▲") : "○"),
        element("span", { class: "what" }, element("b", {}, alarm.id), ` ${alarm.text}`,
          element("small", {}, `${ALARM_STATES[alarm.state]}${alarm.by ? ` by ${alarm.by}` : ""} · since ${seconds(alarm.since)} · priority ${alarm.priority}`)),
        alarm.firstOut ? element("span", { class: "badge" }, "first out") : null), controlsOfAlarm(alarm, this.view)));
    refill(this.list, rows.length ? rows : [element("li", { class: "muted" }, "All alarms are normal.")]);
    this.count = alarms.filter((alarm) => alarm.stands).length;
    this.view.badge("alarms", this.count);
  }
}
