// SPDX-License-Identifier: Apache-2.0
// Heat maps of the bottles on a grid: density, greatest force, dwell time, over the last minute or the whole recording.

import { isDark, SCALES, STEPS } from "./colours.js";
import { signedArea } from "./shapes.js";

export const HEATS = {
  "": { label: "none" },
  density: { label: "density", unit: "bottles/m²", of: ({ seconds, total, cell }, i) => seconds[i] / total / cell ** 2 },
  force: { label: "peak force", unit: "N", of: ({ force }, i) => force[i] },
  dwell: { label: "dwell time", unit: "s", of: ({ seconds, visits }, i) => seconds[i] / visits[i] },
};
export const LAST = 60; // s
const CELLS = [0.05, 0.1, 0.2, 0.5, 1, 2, 5]; // m
const MOST_CELLS = 200; // along the longest side
const BEYOND = 0.6; // cells from the middle of a cell at which a bottle has left it, so that a standing bottle stays in one cell
const POINTS = 1e6; // positions from which a map is made, at most; of more, only every second, third, ... frame
const MOST_BLOCKS = 300; // blocks from which the map of a whole recording is made; of more, evenly spaced ones
const PAUSE = 1000; // ms between two maps while time runs
const SHOWN_EVERY = 10; // blocks between two drawings while a recording is read
const TOP = 0.98; // quantile of the cells with bottles that has the strongest colour

// Time, visits and greatest force of bottles per cell.
class Grid {
  constructor([x0, y0, x1, y1], radius) {
    const side = Math.max(x1 - x0, y1 - y0);
    this.cell = CELLS.find((cell) => cell >= 1.5 * radius && cell * MOST_CELLS >= side) ?? side / MOST_CELLS;
    [this.x, this.y] = [x0, y0];
    [this.columns, this.rows] = [x1 - x0, y1 - y0].map((length) => Math.max(1, Math.ceil(length / this.cell)));
    [this.seconds, this.visits, this.force] = [0, 1, 2].map(() => new Float32Array(this.columns * this.rows));
    this.total = 0; // s
    this.cells = new Map(); // last cell of each bottle
    this.end = NaN; // time of the last frame, s
  }

  // Adds every `stride`-th frame of a block from a time to another.
  add(block, steps, from, to, stride = 1) {
    const { times } = block, usual = times.length > 1 ? (times[times.length - 1] - times[0]) / (times.length - 1) : 0;
    const taken = Array.from(times, (time, frame) => frame % stride === 0 && time >= from && time <= to);
    const first = taken.indexOf(true);
    if (first < 0) return;
    if (!(times[first] - this.end < 1.5 * stride * usual)) this.cells.clear(); // time is missing before this block
    this.end = times[taken.lastIndexOf(true)];
    const length = stride * usual; // of a frame, s
    this.total += taken.filter(Boolean).length * length;
    for (const track of block.tracks) {
      let cell = this.cells.get(track.id) ?? -1;
      for (let k = 0; k < track.count; k++) {
        if (!taken[track.first + k]) continue;
        const next = this._cell(track.x[k], track.y[k], cell);
        if (next < 0) continue;
        if (next !== cell) this.visits[next]++;
        cell = next;
        this.seconds[cell] += length;
        this.force[cell] = Math.max(this.force[cell], track.force[Math.floor((track.first + k) / steps.forceFrames) - track.firstSlot] ?? 0);
      }
      this.cells.set(track.id, cell);
    }
  }

  // Returns the cell of a place, which is the one before until it is left; -1 outside.
  _cell(x, y, before) {
    const across = (x - this.x) / this.cell, up = (y - this.y) / this.cell;
    if (before >= 0) {
      const column = before % this.columns, row = (before - column) / this.columns;
      if (Math.abs(across - column - 0.5) < BEYOND && Math.abs(up - row - 0.5) < BEYOND) return before;
    }
    const column = Math.floor(across), row = Math.floor(up);
    return column < 0 || row < 0 || column >= this.columns || row >= this.rows ? -1 : row * this.columns + column;
  }
}

export class Heat {
  constructor(view) {
    Object.assign(this, { view, grid: null, key: "", made: 0, read: 1, most: 0, image: null, look: "" });
    // Outlines of one orientation, so that overlapping surfaces do not exclude each other.
    this.outlines = view.recording.head.surfaces.map(({ outline }) => (signedArea(outline) < 0 ? [...outline].reverse() : outline));
  }

  get shown() {
    return HEATS[this.view.shownHeat];
  }

  // Text of the legend on the part of the recording that is shown.
  get extent() {
    const { shownSpan, recording } = this.view, whole = recording.source ? "the recording" : "the received data";
    const part = this.read < 1 ? `, ${Math.floor(100 * this.read)} % read` : "";
    return `${shownSpan === "last" ? `last ${LAST} s` : whole}, cells of ${+(this.grid?.cell ?? 0).toPrecision(2)} m${part}`;
  }

  _empty() {
    const { camera, recording: { head } } = this.view;
    return new Grid(camera.bounds, Math.max(0, ...head.types.map(({ radius }) => radius)));
  }

  // Makes the map again if it is out of date.
  update(now) {
    const { view } = this, { recording, clock, shownSpan } = view;
    if (!this.shown.of) {
      this.key = "";
      return;
    }
    if (shownSpan === "whole" && recording.source) {
      if (this.key !== "whole") this._whole();
      return;
    }
    const [from, to] = shownSpan === "last" ? [clock.time - LAST, clock.time] : [recording.start, recording.end];
    const numbers = [], blocks = [];
    for (let number = recording.number(Math.max(from, recording.start)); number <= recording.number(to); number++) numbers.push(number);
    for (const number of numbers) blocks.push(recording.block(number));
    const there = blocks.filter(Boolean), key = `${shownSpan} ${to} ${there.length}`;
    if (key === this.key || ((clock.playing || view.line) && this.key && now - this.made < PAUSE)) return;
    [this.key, this.made, this.read] = [key, now, there.length / blocks.length];
    const points = there.reduce((sum, block) => sum + block.tracks.reduce((all, { count }) => all + count, 0), 0);
    this.grid = this._empty();
    for (const block of there) this.grid.add(block, recording.head.steps, from, to, Math.max(1, Math.ceil(points / POINTS)));
    this.look = "";
  }

  // Reads the whole recording block by block; the map fills meanwhile.
  async _whole() {
    const { recording } = this.view, count = Math.min(recording.count, MOST_BLOCKS);
    this.key = "whole";
    const grid = this.grid = this._empty();
    for (let i = 0; i < count; i++) {
      const block = await recording.read(Math.floor((i * recording.count) / count));
      if (this.grid !== grid) return; // another map was chosen
      grid.add(block, recording.head.steps, -Infinity, Infinity);
      this.read = (i + 1) / count;
      if (i % SHOWN_EVERY && i + 1 < count) continue;
      this.look = "";
      this.view.touch();
    }
  }

  // Returns the value of the strongest colour.
  _top() {
    const { grid, shown } = this, values = [];
    if (!grid?.total) return 0;
    grid.seconds.forEach((time, i) => time > 0 && values.push(shown.of(grid, i)));
    return values.sort((a, b) => a - b)[Math.floor(TOP * (values.length - 1))] ?? 0;
  }

  draw(context, camera) {
    if (!this.shown?.of || !this.grid) return;
    const { grid, shown, view: { rival } } = this, look = `${shown.label} ${isDark()}`;
    if (this.look !== look) [this.look, this.top, this.image] = [look, this._top(), null];
    const most = Math.max(this.top, rival?.heat.top ?? 0);
    if (!this.image || most !== this.most) this._paint(most);
    const { columns, rows, cell, x, y } = grid;
    context.save();
    context.beginPath();
    for (const outline of this.outlines) {
      outline.forEach(([px, py], k) => context[k ? "lineTo" : "moveTo"](camera.toX(px), camera.toY(py)));
      context.closePath();
    }
    context.clip();
    context.imageSmoothingEnabled = false;
    context.drawImage(this.image, camera.toX(x), camera.toY(y + rows * cell), columns * cell * camera.scale, rows * cell * camera.scale);
    context.restore();
  }

  _paint(most) {
    const { grid, shown } = this, { columns, rows } = grid, colours = heatColours();
    this.most = most;
    this.image = new OffscreenCanvas(columns, rows);
    const context = this.image.getContext("2d");
    grid.seconds.forEach((time, i) => {
      if (!time) return;
      context.fillStyle = colours[Math.min(STEPS - 1, Math.floor((shown.of(grid, i) / Math.max(most, 1e-9)) * STEPS))];
      context.fillRect(i % columns, rows - 1 - Math.floor(i / columns), 1, 1);
    });
  }
}

// Returns the colours of heat maps, from those near the background to the strongest contrast: Cividis.
export const heatColours = () => (isDark() ? SCALES.speed : SCALES.age);
