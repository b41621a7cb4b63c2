// SPDX-License-Identifier: Apache-2.0
// The scrubber: position in time, with marks of alarms, faults, refusals and failed conditions.

import { palette } from "./colours.js";
import { byId, element, seconds, sharp } from "./dom.js";

// Colour, weight, and shape, because colours alone are not accessible.
const KINDS = {
  alarm: ["#d55e00", 0, "triangle"], fault: ["#cc79a7", 1, "diamond"], refused: ["#e69f00", 1, "cross"], failed: ["#d1330d", 2, "disc"],
  difference: ["#8250df", 2, "square"],
};
export const MARKS = [["▼", "alarm"], ["◆", "fault"], ["✕", "refused command"], ["●", "failed condition, below"], ["■", "difference of two recordings, below"]];
const NEAR = 6; // px
const SHAPES = {
  triangle: [[-1, -0.8], [1, -0.8], [0, 1]], diamond: [[0, -1.2], [1.1, 0], [0, 1.2], [-1.1, 0]], square: [[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]],
};

// Draws the symbol of a kind of mark.
function drawShape(context, shape, x, y, reach) {
  context.beginPath();
  if (shape === "disc") context.arc(x, y, reach, 0, 2 * Math.PI);
  else if (shape === "cross") {
    for (const side of [-1, 1]) {
      context.moveTo(x - reach, y - side * reach);
      context.lineTo(x + reach, y + side * reach);
    }
    context.lineWidth = 2.5;
    context.stroke();
  } else SHAPES[shape].forEach(([dx, dy], k) => context[k ? "lineTo" : "moveTo"](x + dx * reach, y + dy * reach));
  context.fill();
}

export class Scrubber {
  constructor(view) {
    this.view = view;
    this.box = byId("scrubber");
    this.canvas = this.box.querySelector("canvas");
    this.tip = element("div", { class: "tip", role: "tooltip", hidden: true });
    this.box.append(this.tip);
    this.dragging = false;
    this.box.addEventListener("pointerdown", (event) => {
      this.box.setPointerCapture(event.pointerId);
      this.dragging = true;
      const mark = this._markAt(event);
      if (mark) view.jump(mark.time);
      else this._seek(event);
    });
    this.box.addEventListener("pointermove", (event) => {
      if (this.dragging) this._seek(event);
      this._tell(event);
    });
    for (const end of ["pointerup", "pointercancel"]) this.box.addEventListener(end, () => (this.dragging = false));
    this.box.addEventListener("pointerleave", () => (this.tip.hidden = true));
  }

  x(time) {
    const { start, end } = this.view.clock.recording;
    return 8 + ((time - start) / Math.max(end - start, 1e-9)) * (this.box.clientWidth - 16);
  }

  _time(event) {
    const { start, end } = this.view.clock.recording, box = this.box.getBoundingClientRect();
    return Math.min(end, Math.max(start, start + ((event.clientX - box.left - 8) / (box.width - 16)) * (end - start)));
  }

  _seek(event) {
    this.view.clock.seek(this._time(event));
    this.view.snap();
  }

  _markAt(event) {
    const px = event.clientX - this.box.getBoundingClientRect().left;
    const near = this.view.story.marks.filter((mark) => Math.abs(this.x(mark.time) - px) < NEAR && mark.time >= this.view.clock.recording.start);
    return near.sort((a, b) => KINDS[b.kind][1] - KINDS[a.kind][1] || Math.abs(this.x(a.time) - px) - Math.abs(this.x(b.time) - px))[0];
  }

  _tell(event) {
    const mark = this._markAt(event), time = mark ? mark.time : this._time(event);
    this.tip.textContent = mark ? `${seconds(time)} ${mark.text}` : seconds(time);
    this.tip.hidden = false;
    const half = this.tip.offsetWidth / 2;
    this.tip.style.left = `${Math.min(this.box.clientWidth - half, Math.max(half, this.x(time)))}px`;
  }

  draw() {
    const context = sharp(this.canvas);
    if (!context) return;
    const { clock, clock: { recording }, story } = this.view, colours = palette(), height = this.canvas.clientHeight, middle = height / 2;
    const line = (from, to, width, colour) => {
      context.fillStyle = colour;
      context.fillRect(from, middle - width / 2, to - from, width);
    };
    line(this.x(recording.start), this.x(recording.end), 4, colours.beltEdge);
    line(this.x(recording.start), this.x(clock.time), 4, colours.line);
    for (const mark of story.marks) {
      if (mark.time < recording.start) continue;
      const [colour, weight, shape] = KINDS[mark.kind], x = this.x(mark.time);
      context.fillStyle = context.strokeStyle = colour;
      context.fillRect(x - 1, 4, weight > 1 ? 3 : 2, height - 8);
      drawShape(context, shape, x, weight > 1 ? height - 5 : 5, weight > 1 ? 5 : 4);
    }
    context.beginPath();
    context.arc(this.x(clock.time), middle, 8, 0, 2 * Math.PI);
    context.fillStyle = colours.line;
    context.fill();
    context.lineWidth = 2;
    context.strokeStyle = colours.halo;
    context.stroke();
    this.box.setAttribute("aria-valuemin", recording.start.toFixed(2));
    this.box.setAttribute("aria-valuemax", recording.end.toFixed(2));
    this.box.setAttribute("aria-valuenow", clock.time.toFixed(2));
    this.box.setAttribute("aria-valuetext", seconds(clock.time));
  }
}
