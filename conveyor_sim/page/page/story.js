// SPDX-License-Identifier: Apache-2.0
// The story: events, alarms, states of machines, counters at a time.

import { lastUpTo } from "./block.js";
import { CATEGORIES } from "./colours.js";
import { failureText } from "./failure.js";

const STATE_NAMES = [
  "Undefined", "Clearing", "Stopped", "Starting", "Idle", "Suspended", "Execute", "Stopping", "Aborting", "Aborted",
  "Holding", "Held", "Unholding", "Suspending", "Unsuspending", "Resetting", "Completing", "Complete",
];
export const ALARM_STATES = [
  "normal", "unacknowledged", "acknowledged", "returned", "latched", "latched, acknowledged", "shelved", "suppressed",
  "out of service", "unconfirmed", "returned, unconfirmed", "latched, unconfirmed",
];
const STANDS = new Set([1, 2, 4, 5, 9, 11]);
export const isStanding = (state) => STANDS.has(state);
const SHOWN = new Set([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);

export const EXECUTE = 6;
const STOPPED = 2, STOPPING = 7, HOLDING = 10, HELD = 11;
const STOP = 3; // value of cntrl_cmd
const WAITS = new Set(["starved", "blocked"]);
const OF_MACHINE = /^(.*)\/(\w+)$/;

// Values of a machine's signal `category`, its time account.
const categoryOf = (value) => Object.keys(CATEGORIES)[value];

// Returns state and category of a machine.
export const stateOf = (view, device) => ({ state: view.signal(`${device}/state`), category: categoryOf(view.signal(`${device}/category`)) });

// Returns a PackML state with the reason of waiting. Execute is one state, however often the machine waits for a bottle.
export function stateName(number, category) {
  const name = STATE_NAMES[number] ?? `state ${number}`;
  return number !== EXECUTE && WAITS.has(category) ? `${name}, ${category}` : name;
}

export const stateColour = (number, category) => CATEGORIES[number === EXECUTE ? "running" : category] ?? CATEGORIES.idle;

const HOLDS = /^(machine_state|signal_|fault_)/;
const COMES = new Set(["bottle_fed", "bottle_spawned"]), GOES = new Set(["bottle_removed", "bottle_rejected", "bottle_deleted"]);
const INTERVENES = /^(signal_|fault_)/;
const OF_ONE = new Set(["alarm_changes", "readback"]); // lists whose second entry states the subject
const timeOf = (row) => row.at ?? row[0];
const LISTS = ["alarm_changes", "readback", "counters", "runs", "wear"];

export class Story {
  constructor(head) {
    this.begin(head);
  }

  // Starts an empty story.
  begin(head) {
    this.head = head;
    this.initial = new Map(head.tags.map(({ name, initial }) => [name, initial]));
    this.differences = []; // differences from another recording, shown as marks
    this.data = { events: {}, alarms: {} };
    for (const list of LISTS) this.data[list] = [];
    this.build();
  }

  // Appends a later part.
  add(data) {
    for (const [name, column] of Object.entries(data.events)) this.data.events[name] = (this.data.events[name] ?? []).concat(column);
    for (const list of LISTS) this.data[list] = this.data[list].concat(data[list]);
    Object.assign(this.data.alarms, data.alarms);
    if (data.bins) this.data.bins = data.bins;
    this.build();
  }

  // Drops entries before a time, except those that are still valid then.
  forget(before) {
    const { data } = this, { events } = data, last = new Map();
    const keep = (events.at ?? []).map((at) => at >= before);
    keep.forEach((kept, i) => {
      if (!kept && HOLDS.test(events.kind[i])) last.set(`${events.kind[i].split("_")[0]} ${events.name[i]}`, i);
    });
    for (const i of last.values()) keep[i] = true;
    for (const [name, column] of Object.entries(events)) events[name] = column.filter((_, i) => keep[i]);
    for (const list of LISTS) {
      const now = new Map(data[list].filter((row) => timeOf(row) < before).map((row) => [OF_ONE.has(list) ? row[1] : "", row]));
      data[list] = [...now.values(), ...data[list].filter((row) => timeOf(row) >= before)];
    }
    this.build();
  }

  build() {
    const { data } = this, { at = [], kind, name, bottle, value, text } = data.events;
    this.events = at.map((time, i) => ({ time, kind: kind[i], name: name[i], bottle: bottle[i], value: value[i], text: text[i] }));
    this.interventions = this.events.filter(({ kind }) => INTERVENES.test(kind));
    this.fed = new Map();
    this.rejected = new Set();
    this.left = new Map(); // by bottle, the event by which it left
    this.machines = new Map(); // by machine, times of state changes
    this.reasons = new Map(); // by machine, times and texts of its stop reasons
    const now = new Map();
    for (const event of this.events) {
      if (COMES.has(event.kind)) this.fed.set(event.bottle, event.time);
      if (GOES.has(event.kind)) this.left.set(event.bottle, event);
      if (event.kind === "bottle_rejected") this.rejected.add(event.bottle);
      if (event.kind === "machine_state") this._state(event, now);
    }
    this.alarms = new Map();
    for (const [time, number, state, active, firstOut, since, by] of data.alarm_changes) {
      if (!this.alarms.has(number)) this.alarms.set(number, { times: [], states: [], ...data.alarms[number] });
      const alarm = this.alarms.get(number);
      alarm.times.push(since > (alarm.times.at(-1) ?? -Infinity) ? Math.min(since, time) : time); // messages may come later than a change
      alarm.states.push({ state, active, firstOut, since, by });
    }
    this.counterTimes = data.counters.map((entry) => entry.at);
    this.marks = this._marks();
  }

  // Returns the initial state of a machine, if it is known.
  initially(device) {
    const [state, category] = ["state", "category"].map((what) => this.initial.get(`${device}/${what}`));
    return { state, category: categoryOf(category) };
  }

  // Returns the machine of an event that repeats its change of state at that tick; "": the event says more.
  repeats({ kind, name }) {
    const [, device, what] = OF_MACHINE.exec(name) ?? [];
    return kind === "machine_state" && what !== "state" && this.machines.has(device) ? device : "";
  }

  // Returns the new state of an event in words, with its reason if known.
  whyOf({ name, time, value }) {
    const [, device] = OF_MACHINE.exec(name);
    const change = this.machines.get(device)?.find((other) => other.time === time), reason = this._reasonAt(device, time, value);
    const text = stateName(value, change?.category);
    return value !== EXECUTE && reason && !WAITS.has(reason) ? `${text}, ${reason}` : text;
  }

  // A failure with the reason of the one before it changes the state only, so that reason continues. A failure stays the
  // reason of a machine that is commanded to stop meanwhile.
  _reasonAt(device, time, state) {
    const { times, texts } = this.reasons.get(device) ?? { times: [], texts: [] }, last = lastUpTo(times, time);
    if (last >= 0 && (times[last] === time || state === HOLDING || state === HELD)) return texts[last];
    return state === STOPPING || state === STOPPED ? this.commandedStop(device, time) : "";
  }

  // Returns the command in force by which a machine stops, as its stop reason; "": none.
  commandedStop(device, time) {
    const valueOf = (command) => this.readBackAt(this.head.commands.indexOf(`${device}/${command}`), time)?.value;
    return valueOf("run") === 0 ? "command run" : valueOf("cntrl_cmd") === STOP ? "command Stop" : "";
  }

  // now: last state of each machine.
  _state({ name, time, value, text }, now) {
    const [, device, what] = OF_MACHINE.exec(name) ?? [];
    if (what === "stop_reason") {
      const reasons = this.reasons.get(device) ?? { times: [], texts: [] };
      reasons.times.push(time);
      reasons.texts.push(text);
      this.reasons.set(device, reasons);
    }
    if (what !== "state" && what !== "category") return;
    const before = now.get(device) ?? this.initially(device), changes = this.machines.get(device) ?? [];
    const after = { ...before, [what]: what === "state" ? value : categoryOf(value) };
    now.set(device, after);
    this.machines.set(device, changes);
    if (changes.length && changes[changes.length - 1].time === time) changes.pop(); // the last change of a tick counts
    const last = changes.length ? changes[changes.length - 1] : this.initially(device);
    const looks = ({ state, category }) => `${stateName(state, category)} ${stateColour(state, category)}`;
    if (looks(after) !== looks(last)) changes.push({ time, ...after });
  }

  _marks() {
    const marks = [...this.differences];
    for (const event of this.events) {
      if (event.kind === "alarm_raised") marks.push({ time: event.time, kind: "alarm", text: `alarm ${event.name.replace(/^alarms\//, "")}${event.text && ": "}${event.text}` });
      if (event.kind === "fault_injected") marks.push({ time: event.time, kind: "fault", text: `fault ${event.name}` });
      if (event.kind === "command_refused") marks.push({ time: event.time, kind: "refused", text: `refused ${event.name}: ${event.text}` });
    }
    for (const failure of this.head.failures ?? []) marks.push({ time: failure.time, text: failureText(failure), kind: "failed" });
    return marks.sort((a, b) => a.time - b.time);
  }

  // Returns the alarms that are not normal at a time, active ones first, by priority.
  alarmsAt(time) {
    const found = [];
    for (const [number, alarm] of this.alarms) {
      const now = alarm.states[lastUpTo(alarm.times, time + 1e-6)];
      if (now && SHOWN.has(now.state)) found.push({ number, ...alarm, ...now, stands: isStanding(now.state) });
    }
    return found.sort((a, b) => b.stands - a.stands || b.priority - a.priority || b.since - a.since);
  }

  countersAt(time) {
    return this.data.counters[lastUpTo(this.counterTimes, time + 1e-6)] ?? null;
  }

  readBackAt(command, time) {
    let found = null;
    for (const [at, place, value, writer] of this.data.readback) {
      if (at > time + 1e-6) break;
      if (place === command) found = { value, writer, since: at };
    }
    return found;
  }

  // Returns the names of the signals that are forced at a time.
  forcedAt(time) {
    const forced = new Set(this.head.forced.map((index) => this.head.signals[index]));
    for (const { kind, name } of this._intervened(time)) {
      if (kind === "signal_forced") forced.add(name);
      if (kind === "signal_unforced") forced.delete(name);
    }
    return forced;
  }

  // Returns the values of the faults that are injected at a time, by name.
  faultsAt(time) {
    const faults = new Map(Object.entries(this.head.faults ?? {}));
    for (const { kind, name, value } of this._intervened(time)) {
      if (kind === "fault_injected") faults.set(name, value);
      if (kind === "fault_cleared") faults.delete(name);
    }
    return faults;
  }

  _intervened(time) {
    const after = this.interventions.findIndex((event) => event.time > time + 1e-6);
    return after < 0 ? this.interventions : this.interventions.slice(0, after);
  }
}
