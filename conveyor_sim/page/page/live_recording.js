// SPDX-License-Identifier: Apache-2.0
// Received data of a running line, as a recording that grows at its end and drops its beginning.

import { emptyBlock } from "./block.js";
import { Recording } from "./recording.js";

const MOST = 300; // blocks in memory, at most
const MOST_POINTS = 6e6; // bottles and contacts in all of them, at most

const nothing = () => ({ ...emptyBlock(), last: new Map(), points: 0 });
const NOTHING = nothing();

export class LiveRecording extends Recording {
  constructor(head) {
    super(null, head);
    this.begin(head);
  }

  // Takes a new head. The recording starts over after a reset of the line, or a gap in the data.
  begin(head) {
    const { first } = head.times;
    const goesOn = this.origin !== undefined && head.run === this.head.run && first * head.tick >= this.end;
    this.head = head;
    this.began = 0;
    if (!goesOn) {
      this.origin = this.start = first * head.tick;
      this.blocks.clear();
      this.points = 0;
    }
    this.end = first * head.tick;
    this.count = this.number(this.end) + 1;
  }

  // Returns the newest value of a signal.
  latest(name) {
    return this.signal(name, this.end);
  }

  number(time) {
    return Math.max(0, Math.floor((time - this.origin + 1e-6) / this.length));
  }

  block(number) {
    return this.blocks.get(number) ?? NOTHING;
  }

  load(number) {
    return Promise.resolve(this.block(number));
  }

  // time: s; read: a block of this moment alone.
  append({ time, block: read }) {
    this.end = Math.max(this.end, time);
    this.count = this.number(this.end) + 1;
    this._bottles(read);
    for (const table of ["belts", "signals"]) this._table(table, read[table]);
    while (this.blocks.size > MOST || (this.points > MOST_POINTS && this.blocks.size > 1)) {
      const [oldest, block] = this.blocks.entries().next().value;
      this.blocks.delete(oldest);
      this.points -= block.points;
      this.start = this.origin + (oldest + 1) * this.length;
    }
  }

  _blockAt(time) {
    const number = this.number(time);
    if (!this.blocks.has(number)) this.blocks.set(number, nothing());
    return this.blocks.get(number);
  }

  _count(block, points) {
    block.points += points;
    this.points += points;
  }

  _bottles(read) {
    if (!read.times.length || read.times[0] < this.start) return;
    if (!this.points) this.start = Math.max(this.start, read.times[0]); // the data before is incomplete
    const block = this._blockAt(read.times[0]), { forceFrames } = this.head.steps;
    if (!(read.times[0] <= block.times[block.times.length - 1])) {
      const frame = block.times.push(read.times[0]) - 1, slot = Math.floor(frame / forceFrames);
      for (const { id, type, x, y, force } of read.tracks) {
        let track = block.last.get(id);
        if (!track || track.type !== type || track.first + track.count !== frame) { // a machine may have held or changed it
          track = { id, type, first: frame, count: 0, x: [], y: [], force: [], firstSlot: slot, place: track?.place ?? block.last.size };
          block.tracks.push(track);
          block.last.set(id, track);
          if (!block.byId.has(id)) block.byId.set(id, track);
        }
        track.count++;
        track.x.push(x[0]);
        track.y.push(y[0]);
        const k = slot - track.firstSlot;
        track.force[k] = Math.max(track.force[k] ?? 0, force[0]);
      }
      this._count(block, read.tracks.length);
    }
    for (const contacts of read.contacts) {
      if (contacts.time <= block.contacts[block.contacts.length - 1]?.time) continue;
      const place = (k) => (k < 0 ? -1 : block.last.get(read.tracks[k].id)?.place ?? -1);
      block.contacts.push({ ...contacts, a: contacts.a.map(place), b: contacts.b.map(place) });
      this._count(block, contacts.force.length);
    }
  }

  _table(name, read) {
    if (!read.times.length || read.times[0] < this.start) return;
    const table = this._blockAt(read.times[0])[name];
    if (read.times[0] <= table.times[table.times.length - 1]) return;
    const row = table.times.push(read.times[0]) - 1;
    read.columns.forEach(({ values }, i) => {
      const column = (table.columns[i] ??= { rows: [], values: [] }), value = values[0] ?? 0;
      const before = column.values.length ? column.values[column.values.length - 1] : 0;
      if (Object.is(value, before)) return;
      column.rows.push(row);
      column.values.push(value);
    });
  }
}
