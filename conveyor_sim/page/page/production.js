// SPDX-License-Identifier: Apache-2.0
// Figures of a line from its story: bottles that left it, throughput, OEE, and alarms.

import { lastUpTo } from "./block.js";

const EXITS = new Set(["sink", "outfeed"]); // classes of the devices by which bottles leave the line

const TIMES = new WeakMap(); // by list of events, the times at which bottles left the line, and at which alarms came

function timesOf({ story: { events }, recording: { head } }) {
  if (!TIMES.has(events)) {
    const exits = new Set(head.tags.filter((tag) => EXITS.has(tag.class)).map((tag) => tag.device)), times = { left: [], alarms: [], exits };
    for (const { kind, name, time } of events) {
      if (kind === "bottle_removed" && exits.has(name)) times.left.push(time);
      if (kind === "alarm_raised") times.alarms.push(time);
    }
    TIMES.set(events, times);
  }
  return TIMES.get(events);
}

const counted = (times, from, to) => lastUpTo(times, to + 1e-6) - lastUpTo(times, from + 1e-6);

// Returns the bottles per hour that left a line in a span; null: it has no exit, or the span has no length.
export function throughput(view, from, to) {
  const { left, exits } = timesOf(view);
  return exits.size && to - from > 1e-6 ? (3600 * counted(left, from, to)) / (to - from) : null;
}

// Returns the OEE of the line up to a time, since the last reset of its counters; null: it is unknown.
export function lineOee({ story, recording: { head } }, time) {
  const entry = story.countersAt(time), row = entry?.name.indexOf("line") ?? -1;
  return row < 0 ? null : entry.rows[row][head.fields.counters.indexOf("oee")];
}

// Returns the number of alarms raised in a span.
export const alarmsRaised = (view, from, to) => counted(timesOf(view).alarms, from, to);

export const NONE = "–";
export const perHour = (value) => (value === null ? NONE : `${Math.round(value)} /h`);
export const inPercent = (share) => (share === null || share === undefined ? NONE : `${(100 * share).toFixed(1)} %`);
export const inNewton = (value) => (value === null || value === undefined ? NONE : `${+value.toPrecision(3)} N`);
