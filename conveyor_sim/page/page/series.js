// SPDX-License-Identifier: Apache-2.0
// Values by name and time, of all that has a value: signals, commands in force, and alarms (1 while they stand).

import { lastUpTo } from "./block.js";
import { isStanding } from "./story.js";

const ALARMS = "alarms/";

export class Series {
  constructor(view) {
    this.view = view;
  }

  // Returns true for the name of a signal, of a command, of an alarm that was raised, and for those that a test has read.
  has(name) {
    const { recording: { signalIndex, head } } = this.view;
    return signalIndex.has(name) || head.commands.includes(name) || this._alarm(name) !== null || (head.trends ?? []).includes(name);
  }

  // Returns the names of all signals, commands, and alarms that were raised.
  names() {
    const { recording: { head }, story } = this.view;
    return [...head.signals, ...head.commands, ...Array.from(story.alarms.values(), ({ id }) => `${ALARMS}${id}`)];
  }

  // Returns the tag of a name; undefined: it has none.
  tag(name) {
    return this.view.recording.tags.get(name) ?? (name.startsWith(ALARMS) ? { name, kind: "bool" } : undefined);
  }

  value(name) {
    const { recording, clock } = this.view;
    if (recording.signalIndex.has(name)) return recording.signal(name, clock.time);
    const { times, values } = this._changes(name);
    return values[lastUpTo(times, clock.time + 1e-6)];
  }

  // Returns times and values in a span; changes have a value before and after them.
  between(name, from, to) {
    const { recording } = this.view;
    if (recording.signalIndex.has(name)) return recording.series(name, from, to);
    const { times, values } = this._changes(name), end = Math.min(to, recording.end), first = lastUpTo(times, from), last = lastUpTo(times, end);
    if (last < 0) return { times: [], values: [] };
    const steps = new Map(first < 0 ? [] : [[from, values[first]]]);
    for (let place = first + 1; place <= last; place++) steps.set(times[place], values[place]);
    steps.set(end, values[last]);
    return { times: [...steps.keys()], values: [...steps.values()] };
  }

  _alarm(name) {
    if (!name.startsWith(ALARMS)) return null;
    for (const alarm of this.view.story.alarms.values()) if (`${ALARMS}${alarm.id}` === name) return alarm;
    return null;
  }

  _changes(name) {
    const { story, recording } = this.view, place = recording.head.commands.indexOf(name);
    if (name.startsWith(ALARMS)) {
      const { times, states } = this._alarm(name) ?? { times: [], states: [] };
      return { times: [recording.began, ...times], values: [0, ...states.map(({ state }) => +isStanding(state))] };
    }
    const rows = place < 0 ? [] : story.data.readback.filter((row) => row[1] === place);
    return { times: rows.map(([time]) => time), values: rows.map((row) => row[2]) };
  }
}
