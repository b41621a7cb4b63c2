// SPDX-License-Identifier: Apache-2.0
// Conversion between metres and pixels of the canvas: zoomed by wheel, two fingers or keys, moved by dragging.

const MOST = 20000; // px per metre
const MARGIN = 40; // px around what the window shows

export class Camera extends EventTarget {
  constructor(bounds) {
    super();
    this.bounds = bounds; // least x, y, greatest x, y, m
    this.scale = 100;
    this.x = (bounds[0] + bounds[2]) / 2;
    this.y = (bounds[1] + bounds[3]) / 2;
    this.width = this.height = 1;
    this.under = 36; // px at the lower edge that the legend covers
    this.over = 0; // px at the upper edge that a notice covers
    this.fitted = true; // true while it shows the complete plant, in a window of any size
    this.box = null; // part of the plant that it shows in a window of any size, until the user moves it
  }

  resize(width, height) {
    [this.width, this.height] = [width, height];
    if (this.fitted) this.fit();
    else if (this.box) this.showBox(this.box);
    else this._changed();
  }

  // Shows the complete plant, and continues to do so when the window changes.
  fit() {
    this._enclose(this.bounds);
    this._changed(true);
  }

  // Shows a part of the plant. box: least x and y, greatest x and y, m.
  showBox(box) {
    this._enclose(box);
    this._changed(false, box);
  }

  // under, over: heights of what covers the lower and the upper edge, px.
  cover(under, over) {
    if (under === this.under && over === this.over) return;
    [this.under, this.over] = [under, over];
    this.resize(this.width, this.height);
  }

  _enclose([x0, y0, x1, y1]) {
    const margin = Math.min(MARGIN, 0.1 * Math.min(this.width, this.height));
    const above = Math.max(margin, this.over), below = this.under + (this.over ? 0.4 : 1) * margin; // a notice takes its room from the margins
    this.x = (x0 + x1) / 2;
    const fitting = Math.min((this.width - 2 * margin) / Math.max(x1 - x0, 0.01), (this.height - above - below) / Math.max(y1 - y0, 0.01));
    this.scale = Math.min(MOST, Math.max(1, fitting));
    this.y = (y0 + y1 + (above - below) / this.scale) / 2;
  }

  toX(x) {
    return this.width / 2 + (x - this.x) * this.scale;
  }

  toY(y) {
    return this.height / 2 - (y - this.y) * this.scale;
  }

  at(px, py) {
    return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale];
  }

  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = this.at(px, py);
    this.scale = Math.min(MOST, Math.max(1, this.scale * factor));
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
    this._changed();
  }

  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this._changed();
  }

  centre(x, y) {
    [this.x, this.y] = [x, y];
    this._changed();
  }

  // Shows a point at a scale.
  look(x, y, scale) {
    [this.x, this.y, this.scale] = [x, y, Math.min(MOST, Math.max(1, scale))];
    this._changed();
  }

  // Centres a point unless it is visible.
  show(x, y, margin = 40) {
    const [px, py] = [this.toX(x), this.toY(y)];
    if (px < margin || py < margin || px > this.width - margin || py > this.height - margin) this.centre(x, y);
  }

  _changed(fitted = false, box = null) {
    [this.fitted, this.box] = [fitted, box];
    this.dispatchEvent(new Event("change"));
  }

  // Handles pointers on a canvas; clicked(px, py): a press without a move; moved(): the user pans.
  listen(canvas, clicked, moved) {
    const down = new Map();
    let far = 0, apart = 0;
    const local = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0016)), ...local(event));
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      down.set(event.pointerId, local(event));
      if (down.size === 1) far = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = down.get(event.pointerId);
      if (!before) return;
      const now = local(event);
      down.set(event.pointerId, now);
      far += Math.hypot(now[0] - before[0], now[1] - before[1]);
      if (far < 4) return;
      if (down.size === 1) this.pan(now[0] - before[0], now[1] - before[1]);
      else {
        const [a, b] = [...down.values()];
        const distance = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (apart) this.zoom(distance / apart, (a[0] + b[0]) / 2, (a[1] + b[1]) / 2);
        apart = distance;
      }
      moved();
    });
    const up = (event) => {
      if (down.delete(event.pointerId) && far < 4 && event.type === "pointerup") clicked(...local(event));
      apart = 0;
    };
    canvas.addEventListener("pointerup", up);
    canvas.addEventListener("pointercancel", up);
  }
}
