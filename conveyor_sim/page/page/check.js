// SPDX-License-Identifier: Apache-2.0
// The page of a scene that is being written: its plan and its problems, which follow every save.

import { Camera } from "./camera.js";
import { byId, element } from "./dom.js";
import { Plan } from "./plan.js";
import { boundsOf } from "./shapes.js";
import { openSource } from "./source.js";

// A scene at rest, with what the plan asks of a recording.
class Still {
  constructor(plan) {
    this.head = plan;
    this.shown = { bottles: plan.bottles, places: [], contacts: null };
  }

  at(table, belt) {
    return this.head.speeds[belt];
  }

  frame() {
    return this.shown;
  }
}

class CheckView {
  constructor() {
    this.camera = new Camera([-1, -1, 1, 1]);
    this.problems = [];
    this.plan = null;
    this.camera.addEventListener("change", () => this.draw());
  }

  // plan: of the last valid scene; null before there is one.
  show({ plan, problems, valid, overview }) {
    const state = valid ? "valid" : plan ? "not valid; the plan is that of the last valid scene" : "not valid";
    byId("state").textContent = state;
    byId("state").className = valid ? "valid" : "invalid";
    byId("overview").textContent = overview.join("\n");
    this.problems = problems;
    byId("problems").replaceChildren(...problems.map((problem, i) => this._row(problem, i)));
    byId("spots").replaceChildren(...problems.map((problem, i) => this._spot(problem, i)).filter(Boolean));
    if (plan) this._plan(plan);
    document.body.dataset.ready = "yes";
  }

  _plan(plan) {
    byId("scene").textContent = document.title = plan.scene;
    const recording = new Still(plan), { camera } = this;
    const quiet = { touch: () => this.draw(), signal: () => undefined, wear: { draw() {} }, heat: { draw() {} }, showForces: false, showNames: true, bottle: null, colouring: "type" };
    this.plan = new Plan(byId("plan"), { ...quiet, recording, camera, clock: { time: 0, playing: false } });
    camera.bounds = boundsOf([recording]);
    this.plan.resize();
  }

  _row({ level, where, path, text }, i) {
    const place = element("small", {}, [where, path].filter(Boolean).join(": "));
    return element("li", { class: level, onclick: () => this.choose(i) }, element("b", {}, text), place);
  }

  _spot({ level, at, path, text }, i) {
    return at && element("button", { class: level, title: text, dataset: { path, at: JSON.stringify(at) }, onclick: () => this.choose(i) }, `${i + 1}`);
  }

  choose(i) {
    Array.from(byId("problems").children, (row, k) => row.classList.toggle("chosen", k === i));
    byId("problems").children[i].scrollIntoView({ block: "nearest" });
    const { at } = this.problems[i];
    if (at) this.camera.show(...at);
  }

  draw() {
    if (!this.plan) return;
    this.plan.update();
    this.plan.draw();
    for (const spot of byId("spots").children) {
      const [x, y] = JSON.parse(spot.dataset.at);
      spot.style.left = `${this.camera.toX(x)}px`;
      spot.style.top = `${this.camera.toY(y)}px`;
    }
  }

  resize() {
    if (this.plan) this.plan.resize();
  }
}

async function start() {
  const source = openSource(), view = new CheckView(), { camera } = view;
  const clicks = { fit: () => camera.fit(), closer: () => camera.zoom(1.5), farther: () => camera.zoom(1 / 1.5) };
  for (const [id, action] of Object.entries(clicks)) byId(id).addEventListener("click", action);
  camera.listen(byId("plan"), () => {}, () => {});
  new ResizeObserver(() => view.resize()).observe(byId("stage"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => view.draw());
  for (let number = 0; ;) {
    const result = JSON.parse(new TextDecoder().decode(await source.bytes(`check/${number}`)));
    if (result.number !== number) view.show(result);
    number = result.number;
    document.body.dataset.number = number;
  }
}

start();
