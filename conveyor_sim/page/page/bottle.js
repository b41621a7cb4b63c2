// SPDX-License-Identifier: Apache-2.0
// One bottle: type, speed, and forces over the last seconds.

import { palette } from "./colours.js";
import { element, seconds, sharp, titled } from "./dom.js";

const SHOWN = 10; // seconds shown

export class Bottle {
  constructor(view) {
    this.view = view;
    this.facts = element("dl", { class: "facts" });
    this.follow = element("input", { type: "checkbox", id: "follow", onchange: (event) => view.setFollowing(event.target.checked) });
    this.speed = element("canvas", { class: "spark", role: "img", "aria-label": "Speed over the last 10 s" });
    this.force = element("canvas", { class: "spark", role: "img", "aria-label": "Peak force over the last 10 s" });
    this.root = element("section", {}, element("h2", {}, titled("Bottle", view)), this.facts,
      this.chosen = element("div", {}, element("label", { class: "check" }, this.follow, " Follow it (F)"), this.speed, this.force));
  }

  draw() {
    const { view } = this, { clock, recording, story } = view;
    this.chosen.hidden = view.bottle === null;
    if (this.chosen.hidden) {
      this.facts.replaceChildren(element("dd", { class: "muted whole" }, "Click a bottle on the plan, or choose one with B."));
      return;
    }
    const points = recording.trace(view.bottle, clock.time - SHOWN, clock.time), now = points[points.length - 1];
    const frame = view.plan.frame?.bottles.find(({ id }) => id === view.bottle);
    const fed = story.fed.get(view.bottle), most = Math.max(0, ...points.map(({ force }) => force));
    const rows = [["id", `${view.bottle}`], ["type", frame ? recording.head.types[frame.type].name : "–"],
      ["on the line since", fed === undefined ? "before the start" : seconds(fed)],
      ["place", frame ? `${frame.x.toFixed(3)}, ${frame.y.toFixed(3)} m` : this._away(story.left.get(view.bottle), fed)],
      ["speed", frame ? `${frame.speed.toFixed(2)} m/s` : "–"], ["force", frame ? `${frame.force.toPrecision(3)} N` : "–"],
      [`peak of ${SHOWN} s`, `${most.toPrecision(3)} N`], ["rejected", story.rejected.has(view.bottle) ? "yes" : "no"]];
    this.facts.replaceChildren(...rows.flatMap(([term, value]) => [element("dt", {}, term), element("dd", {}, value)]));
    this.follow.checked = view.following;
    if (now) {
      this._chart(this.speed, points.map(({ time, speed }) => [time, speed]), "speed", "m/s");
      this._chart(this.force, points.map(({ time, force }) => [time, force]), "force", "N");
    }
  }

  // Returns where a bottle went that is not on the plan, as a link to the event.
  _away(left, fed) {
    const { view } = this, { time } = view.clock;
    if (fed > time + 1e-6) return `comes at ${seconds(fed)}`;
    if (!left || left.time > time + 1e-6) return "not on a belt: held by a machine";
    const how = { bottle_removed: "left", bottle_rejected: "rejected", bottle_deleted: "deleted" }[left.kind];
    const text = `${how} by ${left.name} at ${seconds(left.time)}`;
    if (this.away?.textContent !== text) this.away = element("button", { class: "link", title: "Show this time and place", onclick: () => view.jump(left.time, left.name, left.bottle) }, text);
    return this.away;
  }

  _chart(canvas, points, name, unit) {
    const context = sharp(canvas);
    if (!context) return;
    const colours = palette(), { clientWidth: width, clientHeight: height } = canvas, to = this.view.clock.time;
    const highest = Math.max(0, ...points.map(([, value]) => value)), most = Math.max(1e-3, highest);
    context.strokeStyle = colours.line;
    context.lineWidth = 1.5;
    context.beginPath();
    points.forEach(([time, value], k) => context[k ? "lineTo" : "moveTo"](width * (1 - (to - time) / SHOWN), height - 4 - (value / most) * (height - 22)));
    context.stroke();
    context.fillStyle = colours.muted;
    context.font = "12px system-ui, sans-serif";
    context.fillText(`${name} over ${SHOWN} s, up to ${+highest.toPrecision(3)} ${unit}`, 4, 12);
  }
}
