// Figures of a line from its story: bottles that left it, throughput, OEE, and alarms.

const EXITS = new Set(["sink", "outfeed"]); // classes of the devices by which bottles leave the line

// Returns the devices by which bottles leave a line.
const exitsOf = ({ recording: { head } }) => new Set(head.tags.filter((tag) => EXITS.has(tag.class)).map((tag) => tag.device));

// Returns the number of events in a span that a condition selects.
function counted({ story }, from, to, is) {
  return story.events.reduce((sum, event) => sum + (event.time > from + 1e-6 && event.time <= to + 1e-6 && is(event)), 0);
}

// Returns the bottles per hour that left a line in a span; null: it has no exit, or the span has no length.
export function throughput(view, from, to) {
  const exits = exitsOf(view);
  if (!exits.size || to - from < 1e-6) return null;
  return (3600 * counted(view, from, to, ({ kind, name }) => kind === "bottle_removed" && exits.has(name))) / (to - from);
}

// Returns the OEE of the line up to a time, since the last reset of its counters; null: it is unknown.
export function lineOee({ story, recording: { head } }, time) {
  const entry = story.countersAt(time), row = entry?.name.indexOf("line") ?? -1;
  return row < 0 ? null : entry.rows[row][head.fields.counters.indexOf("oee")];
}

// Returns the number of alarms raised in a span.
export const alarmsRaised = (view, from, to) => counted(view, from, to, ({ kind }) => kind === "alarm_raised");

export const NONE = "–";
export const perHour = (value) => (value === null ? NONE : `${Math.round(value)} /h`);
export const inPercent = (share) => (share === null || share === undefined ? NONE : `${(100 * share).toFixed(1)} %`);
export const inNewton = (value) => (value === null || value === undefined ? NONE : `${+value.toPrecision(3)} N`);
