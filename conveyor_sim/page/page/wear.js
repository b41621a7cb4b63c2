// SPDX-License-Identifier: Apache-2.0
// Wear of rails up to a time as a heat map along them: scuffing or mean pressure in each bin.

import { lastUpTo } from "./block.js";
import { SCALES, STEPS } from "./colours.js";

export const WEARS = {
  "": { label: "plain" },
  scuffing: { label: "by scuffing", unit: "J/m", of: ([, scuffing], i, bins) => scuffing[i] / bins.length[i] },
  pressure: { label: "by pressure", unit: "N/m", of: ([time, , impulse], i, bins, start) => impulse[i] / bins.length[i] / Math.max(time - start, 1e-9) },
};

export const NO_WEAR = 1e-9; // values up to this are treated as none

export class Wear {
  constructor(view) {
    this.view = view;
    this.most = 1;
  }

  get shown() {
    return this.view.shownWear;
  }

  // The scale is that of the end, so that a colour means the same at all times.
  scale() {
    const { story, recording } = this.view, { bins, wear } = story.data, last = wear[wear.length - 1];
    return last ? Math.max(NO_WEAR, ...bins.x.map((_, i) => WEARS[this.shown].of(last, i, bins, recording.began))) : NO_WEAR;
  }

  draw(context, camera) {
    const { story, clock, recording, rival } = this.view, { bins, wear } = story.data;
    const wanted = WEARS[this.shown], row = wear[lastUpTo(wear.map(([time]) => time), clock.time + 1e-6)];
    if (!wanted.of || !row) return;
    this.most = Math.max(this.scale(), rival ? rival.wear.scale() : 0);
    context.lineCap = "butt";
    context.lineWidth = Math.max(6, 0.02 * camera.scale);
    bins.x.forEach((x, i) => {
      const share = wanted.of(row, i, bins, recording.began) / this.most;
      if (share <= 0.01) return;
      context.beginPath();
      for (const side of [-1, 0, 1]) {
        // Halfway to the next bin; at the end of a rail symmetric to the other side.
        const there = bins.rail[i + side] === bins.rail[i], near = there ? i + side : i - side, half = there ? 0.5 : -0.5;
        const known = bins.rail[near] === bins.rail[i] ? half : 0;
        context[side < 0 ? "moveTo" : "lineTo"](camera.toX(x + known * ((bins.x[near] ?? x) - x)), camera.toY(bins.y[i] + known * ((bins.y[near] ?? 0) - bins.y[i])));
      }
      context.strokeStyle = SCALES.force[Math.min(STEPS - 1, Math.floor(share * STEPS))];
      context.stroke();
    });
  }
}
