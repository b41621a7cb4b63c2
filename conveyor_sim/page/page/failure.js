// SPDX-License-Identifier: Apache-2.0
// The page of a failed test: the condition with its values, and the time from the last action of the test to the failure.

import { element, seconds, shown } from "./dom.js";

// Returns how long after the last action a condition failed; "": the test gave no input.
export const afterAction = ({ time, action }) => (action ? `${seconds(time - action.time)} after ${action.text}` : "");

// Returns a failed condition in one sentence.
export const failureText = (failure) => [failure.text, afterAction(failure)].filter(Boolean).join("; ");

export class Failure {
  constructor(view) {
    this.view = view;
    this.rows = [];
    this.root = element("section", { class: "plate failure" }, element("h2", {}, "Failed condition"), ...view.recording.head.failures.map((failure) => this._part(failure)));
  }

  _part(failure) {
    const { view } = this, { time, text, since, values, forced, action } = failure;
    const to = (at, label) => element("button", { class: "link", onclick: () => view.jump(at) }, label);
    const times = [["failed", to(time, seconds(time))], ...(since === null || since === time ? [] : [["asserted from", to(since, seconds(since))]]),
      ...(action ? [["last action", to(action.time, `${action.text} at ${seconds(action.time)}`)], ["from it to the failure", seconds(time - action.time)]] : [["last action", "none by the test"]])];
    const names = Object.keys(values);
    return element("div", {}, element("p", { class: "condition" }, text),
      element("dl", { class: "facts" }, ...times.flatMap(([term, what]) => [element("dt", {}, term), element("dd", {}, what)])),
      names.length ? element("table", {}, element("tr", { class: "whose" }, element("th", { scope: "col" }, "signal"), element("th", { scope: "col" }, "at the failure"), element("th", { scope: "col" }, "now")),
        ...names.map((name) => this._row(name, values[name], forced.includes(name)))) : element("p", { class: "muted" }, "The condition reads no signals."));
  }

  _row(name, value, isForced) {
    const { view } = this, now = element("td", {}), tag = view.series.tag(name);
    this.rows.push({ name, tag, now });
    return element("tr", {}, element("th", { scope: "row" }, element("button", { class: "link", title: "Put on the trends", onclick: () => view.trends.add(name) }, name), element("small", {}, isForced ? "forced" : "")),
      element("td", { class: isForced ? "value forced" : "value" }, shown(value, tag)), now);
  }

  draw() {
    const { series } = this.view;
    for (const { name, tag, now } of this.rows) {
      const text = shown(series.value(name), tag);
      if (now.textContent !== text) now.textContent = text;
    }
  }
}
