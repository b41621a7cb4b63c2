// SPDX-License-Identifier: Apache-2.0
// A second recording of a line, drawn beside the first: same time, camera and colours.

import { byId, element, seconds } from "./dom.js";
import { Heat } from "./heat.js";
import { Plan } from "./plan.js";
import { Series } from "./series.js";
import { Wear } from "./wear.js";

const PARTS = 2; // last parts of a path that are shown

export class Beside {
  constructor(view, recording, story, names) {
    this.view = view;
    this.canvas = element("canvas", { id: "plan_other", tabindex: "0", role: "img", "aria-label": "Plan of the other recording, B" });
    this.captions = names.map((name, i) => element("div", { class: "caption", title: name }, element("b", {}, "AB"[i]), element("span", {}, name.split("/").slice(-PARTS).join("/")), element("small", {})));
    byId("plan").after(this.canvas, ...this.captions);
    byId("plan").setAttribute("aria-label", "Plan of recording A. W, A, S and D move both plans, plus and minus zoom, B chooses a bottle.");
    // Choices and settings are shared with the first view; the rest belongs to this one.
    this.other = Object.create(view);
    view.letter = "A";
    Object.assign(this.other, { recording, story, rival: view, letter: "B", badge: () => {}, jump: (...where) => view.jump(...where) });
    this.other.series = new Series(this.other);
    this.other.wear = new Wear(this.other);
    this.other.heat = new Heat(this.other);
    this.plan = this.other.plan = new Plan(this.canvas, this.other);
    view.rival = this.other;
    view.camera.listen(this.canvas, (px, py) => view.clicked(px, py, this.plan), () => view.setFollowing(false));
  }

  // Side by side or one above the other, whichever draws the line larger.
  resize() {
    const stage = byId("stage"), [x0, y0, x1, y1] = this.view.camera.bounds;
    const scale = (across, up) => Math.min(stage.clientWidth / across / (x1 - x0), stage.clientHeight / up / (y1 - y0));
    stage.dataset.panes = scale(2, 1) >= scale(1, 2) ? "columns" : "rows";
    this.plan.resize();
  }

  draw() {
    [this.view.recording, this.other.recording].forEach(({ end }, i) => {
      const over = this.view.clock.time > end + 1e-6 ? ` ended at ${seconds(end)}` : "";
      const note = this.captions[i].lastChild;
      if (note.textContent !== over) note.textContent = over;
    });
  }
}
