// SPDX-License-Identifier: Apache-2.0
// Wear of rails up to a time as a heat map along them: scuffing or mean pressure in each bin.

import { lastUpTo } from "./block.js";
import { SCALES, STEPS } from "./colours.js";

export const WEARS = {
  "": { label: "plain" },
  scuffing: { label: "by scuffing", unit: "J/m", of: ([, scuffing], i, bins) => scuffing[i] / bins.length[i] },
  pressure: { label: "by pressure", unit: "N/m", of: ([time, , impulse], i, bins, start) => impulse[i] / bins.length[i] / Math.max(time - start, 1e-9) },
};

const DOT = [0.01, 0]; // direction of a bin without neighbours: a path without length is not drawn
export const NO_WEAR = 1e-9; // values up to this are treated as none

// Unit vector from the middle of a bin to its neighbour on a side; null if no entry beside it is near enough.
function towards(bins, i, side) {
  const there = i + side, dx = bins.x[there] - bins.x[i], dy = bins.y[there] - bins.y[i], distance = Math.hypot(dx, dy);
  if (bins.rail[there] !== bins.rail[i] || !(distance > 0) || distance > 0.75 * (bins.length[i] + bins.length[there])) return null;
  return [dx / distance, dy / distance];
}

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
    context.lineCap = "round";
    context.lineWidth = Math.max(6, 0.02 * camera.scale);
    bins.x.forEach((x, i) => {
      const share = wanted.of(row, i, bins, recording.began) / this.most;
      if (share <= 0.01) return;
      context.beginPath();
      const sides = [-1, 1].map((side) => towards(bins, i, side)), half = 0.5 * bins.length[i];
      const [back, ahead] = [sides[0] ?? sides[1]?.map((part) => -part) ?? DOT, sides[1] ?? sides[0]?.map((part) => -part) ?? [0, 0]];
      for (const [dx, dy] of [back, [0, 0], ahead]) context.lineTo(camera.toX(x + half * dx), camera.toY(bins.y[i] + half * dy));
      context.strokeStyle = SCALES.force[Math.min(STEPS - 1, Math.floor(share * STEPS))];
      context.stroke();
    });
  }
}
