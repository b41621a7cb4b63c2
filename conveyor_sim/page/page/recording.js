// SPDX-License-Identifier: Apache-2.0
// A recording by time: frames of bottles, signals, contacts, in blocks that are loaded on request.

import { emptyBlock, lastUpTo, readBlock } from "./block.js";

const KEPT = 64; // blocks in memory: more than trends show
const AT_ONCE = 2; // blocks that are requested at a time
const FAR = 50; // blocks; a request farther from the displayed block is dropped
const NEAR = 1e-6; // s
const SPAN = 2; // frames before and after a time between which a speed is measured

// The number of loading blocks, also as an attribute of the page.
let onTheWay = 0;
function reading(more) {
  onTheWay += more;
  document.body.dataset.reading = onTheWay;
}

export class Recording extends EventTarget {
  constructor(source, head) {
    super();
    this.source = source;
    this.head = head;
    const { first, last, block, blocks } = head.times;
    this.start = this.began = first * head.tick;
    this.end = last * head.tick;
    this.length = block * head.tick; // length of a block, s
    this.count = blocks;
    this.blocks = new Map();
    this.pending = new Map();
    this.waiting = []; // requests: number of the block, and callbacks
    this.reading = 0;
    this.near = null; // number of the displayed block
    this.signalIndex = new Map(head.signals.map((name, index) => [name, index]));
    this.tags = new Map(head.tags.map((tag) => [tag.name, tag]));
  }

  number(time) {
    return Math.min(this.count - 1, Math.max(0, Math.floor((time - this.start + NEAR) / this.length)));
  }

  // Returns a block if it is in memory; else requests it, and "loaded" reports when it is.
  block(number) {
    if (number < 0 || number >= this.count) return null;
    const found = this.blocks.get(number);
    if (found) {
      this.blocks.delete(number);
      this.blocks.set(number, found); // the block used last is dropped last
      return found;
    }
    this.load(number);
    return null;
  }

  load(number) {
    if (!this.blocks.has(number) && !this.pending.has(number)) {
      this.pending.set(number, new Promise((read) => this.waiting.push({ number, read })));
      reading(1);
      this._readNext();
    }
    return this.pending.get(number) ?? Promise.resolve(this.blocks.get(number));
  }

  // Blocks near the displayed time come first; requests that are far from it are dropped.
  _readNext() {
    const far = ({ number }) => (this.near === null ? 0 : Math.abs(number - this.near));
    this.waiting.sort((one, other) => far(other) - far(one));
    while (this.waiting.length && far(this.waiting[0]) > FAR) this._done(this.waiting.shift(), null);
    while (this.reading < AT_ONCE && this.waiting.length) this._read(this.waiting.pop());
  }

  _done({ number, read }, block) {
    this.pending.delete(number);
    reading(-1);
    read(block);
  }

  // Reads a block that need not stay in memory.
  async read(number) {
    const { first, block: length } = this.head.times, there = this.blocks.get(number);
    if (there) return there;
    try {
      const bytes = await this.source.bytes(`block/${number}`);
      return readBlock(bytes, this.head.steps, first + number * length, this.head.tick);
    } catch (error) {
      this.dispatchEvent(new CustomEvent("failed", { detail: error.message }));
      return emptyBlock(); // the block can't be read; the time continues over it
    }
  }

  async _read(wanted) {
    const { number } = wanted;
    this.reading++;
    const block = await this.read(number);
    this.blocks.set(number, block);
    for (const old of this.blocks.keys()) {
      if (this.blocks.size <= KEPT) break;
      this.blocks.delete(old);
    }
    this.reading--;
    this._done(wanted, block);
    this._readNext();
    this.dispatchEvent(new Event("loaded"));
  }

  // Returns the block and the place of the last frame up to a time; null while it loads, or before the first.
  place(time) {
    this.near = this.number(time);
    for (let number = this.near; number >= 0; number--) {
      const block = this.block(number);
      if (!block) return null;
      const frame = lastUpTo(block.times, time + NEAR);
      if (frame >= 0) return { number, block, frame };
    }
    return null;
  }

  // Returns the time of the last frame up to a time; `from`: of the first frame from that time on. Null while it loads.
  frameTime(time, from) {
    const at = this.place(time);
    if (!at) return null;
    const { number, block, frame } = at, last = block.times[frame];
    if (!from || last > time - NEAR) return last;
    if (frame + 1 < block.times.length) return block.times[frame + 1];
    const next = number + 1 < this.count ? this.block(number + 1) : block;
    return next && (next === block ? last : next.times[0] ?? last);
  }

  // Returns the time of the frame some steps after that of a time; null while it loads.
  async stepped(time, steps) {
    await this.load(this.number(time));
    let at = this.place(time);
    if (!at) return null;
    let { number, block, frame } = at;
    frame += steps;
    while (block && frame >= block.times.length && number + 1 < this.count) {
      frame -= block.times.length;
      block = await this.load(++number);
    }
    while (block && frame < 0 && number > 0) {
      block = await this.load(--number);
      frame += block ? block.times.length : 0;
    }
    if (!block || !block.times.length) return null;
    return block.times[Math.min(block.times.length - 1, Math.max(0, frame))];
  }

  // Returns the bottles at a time, interpolated while playing; null while they load.
  frame(time, moving) {
    const at = this.place(time);
    if (!at) return null;
    const { number, block, frame } = at;
    const next = frame + 1 < block.times.length ? null : this.block(number + 1);
    const nextTime = next ? next.times[0] : block.times[frame + 1];
    const share = moving && nextTime > block.times[frame] ? Math.min(1, (time - block.times[frame]) / (nextTime - block.times[frame])) : 0;
    const bottles = [];
    const places = new Int32Array(block.tracks.length).fill(-1);
    for (const track of block.tracks) {
      const k = frame - track.first;
      if (k < 0 || k >= track.count) continue;
      let x = track.x[k], y = track.y[k];
      if (share > 0) {
        const later = next ? next.byId.get(track.id) : track;
        const j = next ? (later && later.first === 0 ? 0 : -1) : k + 1 < track.count ? k + 1 : -1;
        if (j >= 0) {
          x += share * (later.x[j] - x);
          y += share * (later.y[j] - y);
        }
      }
      places[track.place] = bottles.length;
      bottles.push({ id: track.id, type: track.type, x, y, speed: speedOf(block, track, k), force: forceOf(track, frame, this.head.steps) });
    }
    return { time: block.times[frame], bottles, places, contacts: this._contacts(block, time) };
  }

  _contacts(block, time) {
    let found = null;
    for (const contacts of block.contacts) {
      if (contacts.time > time + NEAR) break;
      found = contacts;
    }
    return found;
  }

  // Returns a column of `belts` or `signals` at a time; undefined if it is absent or not loaded.
  at(table, column, time) {
    for (let number = this.number(time), tries = 0; number >= 0 && tries < 2; number--, tries++) {
      const block = this.block(number);
      if (!block) return undefined;
      const row = lastUpTo(block[table].times, time + NEAR);
      if (row < 0) continue;
      const { rows, values } = block[table].columns[column] ?? { rows: [], values: [] };
      const place = lastUpTo(rows, row);
      return place < 0 ? 0 : values[place];
    }
    return undefined;
  }

  signal(name, time) {
    const column = this.signalIndex.get(name);
    return column === undefined ? undefined : this.at("signals", column, time);
  }

  // Returns times and values of a signal in a span, of loaded blocks; requests the others.
  series(name, from, to) {
    const column = this.signalIndex.get(name), times = [], found = [];
    if (column === undefined) return { times, values: found };
    for (let number = this.number(from); number <= this.number(to); number++) {
      const block = this.block(number);
      if (!block) continue;
      const table = block.signals;
      const { rows, values } = table.columns[column] ?? { rows: [], values: [] };
      let place = -1;
      for (let row = 0; row < table.times.length; row++) {
        while (place + 1 < rows.length && rows[place + 1] <= row) place++;
        if (table.times[row] < from - NEAR || table.times[row] > to + NEAR) continue;
        times.push(table.times[row]);
        found.push(place < 0 ? 0 : values[place]);
      }
    }
    return { times, values: found };
  }

  // Returns the path of a bottle in the loaded blocks up to a time: points in order.
  trace(id, from, to) {
    const points = [];
    for (let number = this.number(from); number <= this.number(to); number++) {
      const block = this.block(number);
      for (const track of block?.tracks.filter((other) => other.id === id) ?? []) for (let k = 0; k < track.count; k++) {
        const time = block.times[track.first + k];
        if (time < from - NEAR || time > to + NEAR) continue;
        points.push({ time, x: track.x[k], y: track.y[k], speed: speedOf(block, track, k), force: forceOf(track, track.first + k, this.head.steps) });
      }
    }
    return points;
  }
}

function forceOf(track, frame, steps) {
  return track.force[Math.floor(frame / steps.forceFrames) - track.firstSlot] ?? 0;
}

function speedOf(block, track, k) {
  const a = Math.max(0, k - SPAN), b = Math.min(track.count - 1, k + SPAN);
  if (a === b) return 0;
  const seconds = block.times[track.first + b] - block.times[track.first + a];
  return Math.hypot(track.x[b] - track.x[a], track.y[b] - track.y[a]) / seconds;
}
