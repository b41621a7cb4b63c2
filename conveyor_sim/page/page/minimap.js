// SPDX-License-Identifier: Apache-2.0
// The complete plant in a corner while the plan shows a part of it; a press moves the plan there.

import { palette } from "./colours.js";
import { byId, element, sharp } from "./dom.js";

const SIDE = 168; // px, longest side
const EDGE = 5; // px around the plant

export class Minimap {
  constructor(view) {
    this.view = view;
    this.canvas = element("canvas", { id: "map", role: "img", "aria-label": "The complete plant, and the visible part of it. A press moves the plan." });
    this.canvas.hidden = true;
    byId("zoom").before(this.canvas);
    const go = (event) => {
      if (!event.buttons) return;
      const box = this.canvas.getBoundingClientRect();
      view.setFollowing(false);
      view.camera.centre(...this._at(event.clientX - box.left, event.clientY - box.top));
    };
    this.canvas.addEventListener("pointerdown", (event) => { this.canvas.setPointerCapture(event.pointerId); go(event); });
    this.canvas.addEventListener("pointermove", go);
  }

  // Takes the size that fits a part of the window, px.
  resize(width, height) {
    const [x0, y0, x1, y1] = this.view.camera.bounds, across = Math.max(x1 - x0, 0.01), up = Math.max(y1 - y0, 0.01);
    this.scale = Math.min(Math.min(SIDE, 0.4 * width) / across, Math.min(SIDE, 0.3 * height) / up);
    this.canvas.style.width = `${Math.max(40, across * this.scale + 2 * EDGE)}px`;
    this.canvas.style.height = `${Math.max(40, up * this.scale + 2 * EDGE)}px`;
  }

  _at(px, py) {
    const [x0, y0, x1, y1] = this.view.camera.bounds, { clientWidth, clientHeight } = this.canvas;
    return [(x0 + x1) / 2 + (px - clientWidth / 2) / this.scale, (y0 + y1) / 2 - (py - clientHeight / 2) / this.scale];
  }

  // outlines: of the selected device. Returns true if the map has appeared or disappeared.
  draw(outlines) {
    const { camera, recording: { head } } = this.view, [x0, y0, x1, y1] = camera.bounds, { canvas } = this;
    const hidden = canvas.hidden, covers = (x, y) => camera.toX(x) >= 0 && camera.toX(x) <= camera.width && camera.toY(y) >= 0 && camera.toY(y) <= camera.height;
    canvas.hidden = covers(x0, y0) && covers(x1, y1);
    const context = canvas.hidden ? null : sharp(canvas);
    if (!context) return hidden !== canvas.hidden;
    const colours = palette(), { clientWidth, clientHeight } = canvas;
    const x = (at) => clientWidth / 2 + (at - (x0 + x1) / 2) * this.scale, y = (at) => clientHeight / 2 - (at - (y0 + y1) / 2) * this.scale;
    const path = (points) => points.forEach(([px, py], k) => context[k ? "lineTo" : "moveTo"](x(px), y(py)));
    context.lineWidth = 1;
    for (const { outline } of head.surfaces) {
      context.beginPath();
      path(outline);
      context.closePath();
      context.fillStyle = context.strokeStyle = colours.beltEdge;
      context.fill();
      context.stroke();
    }
    context.beginPath();
    for (const points of outlines) path(points.length > 1 ? points : [points[0], points[0]]);
    context.lineWidth = 4;
    context.lineCap = "round";
    context.strokeStyle = colours.select;
    context.stroke();
    const [left, top] = camera.at(0, 0), [right, bottom] = camera.at(camera.width, camera.height);
    context.lineWidth = 2;
    context.strokeStyle = colours.line;
    context.strokeRect(x(left), y(top), (right - left) * this.scale, (bottom - top) * this.scale);
    return hidden !== canvas.hidden;
  }
}
