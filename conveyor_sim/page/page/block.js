// SPDX-License-Identifier: Apache-2.0
// Reads a block as conveyor_sim/page/block.py packs it. Both files must be changed together.

class Numbers {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }

  next() {
    let value = 0, place = 1, byte;
    do {
      byte = this.bytes[this.at++];
      value += (byte & 0x7f) * place; // no shifts, because numbers may have more than 32 bits
      place *= 128;
    } while (byte & 0x80);
    return value % 2 ? -(value + 1) / 2 : value / 2;
  }

  list() {
    const list = new Float64Array(this.next());
    for (let i = 0; i < list.length; i++) list[i] = this.next();
    return list;
  }

  sums() {
    const list = this.list();
    for (let i = 1; i < list.length; i++) list[i] += list[i - 1];
    return list;
  }
}

// An empty block.
export function emptyBlock() {
  const table = () => ({ times: [], columns: [] });
  return { times: [], tracks: [], byId: new Map(), contacts: [], belts: table(), signals: table(), measured: true };
}

// steps: head.steps; start: tick; tick: s. Times in s, lengths in m, forces in N.
export function readBlock(bytes, steps, start, tick) {
  const numbers = new Numbers(bytes);
  const times = () => numbers.sums().map((ticks) => (start + ticks) * tick);
  const block = { times: times(), tracks: [], byId: new Map() };
  readTracks(numbers, block, steps);
  readContacts(numbers, block, steps, times);
  block.belts = readColumns(numbers, times(), 1 / steps.mm, steps.unknown);
  block.signals = readColumns(numbers, times(), 1 / steps.signal, steps.unknown);
  return block;
}

function newton(level, steps) {
  return steps.force * (2 ** (level / steps.levels) - 1);
}

function readTracks(numbers, block, steps) {
  const ids = numbers.sums(), types = numbers.list(), firsts = numbers.list(), counts = numbers.list();
  const moves = [numbers.list(), numbers.list()], levels = numbers.sums();
  let at = 0, slot = 0, place = -1; // place of a bottle among all, by which contacts refer to bottles
  ids.forEach((id, i) => {
    const first = firsts[i], count = counts[i];
    const [x, y] = moves.map((bends) => {
      const axis = new Float32Array(count);
      for (let k = 0, value = 0, step = 0; k < count; k++) {
        if (k === 0) value = bends[at];
        else {
          step += bends[at + k];
          value += step;
        }
        axis[k] = value / steps.mm;
      }
      return axis;
    });
    at += count;
    const firstSlot = Math.floor(first / steps.forceFrames);
    const slots = Math.floor((first + count - 1) / steps.forceFrames) - firstSlot + 1;
    const force = Float32Array.from(levels.subarray(slot, slot + slots), (level) => newton(level, steps));
    slot += slots;
    if (!block.byId.has(id)) place++;
    const track = { id, type: types[i], first, count, x, y, force, firstSlot, place };
    block.tracks.push(track);
    if (!block.byId.has(id)) block.byId.set(id, track); // first track of a bottle that comes back
  });
}

function readContacts(numbers, block, steps, times) {
  const at = times(), counts = numbers.list();
  const firsts = numbers.list(), others = numbers.list(), points = numbers.list(), levels = numbers.list();
  let next = 0, point = 0;
  block.contacts = Array.from(at, (time, i) => {
    const n = counts[i], a = new Int32Array(n), b = new Int32Array(n), force = new Float32Array(n);
    const x = new Float32Array(n), y = new Float32Array(n);
    for (let k = 0, place = 0; k < n; k++, next++) {
      place += firsts[next];
      a[k] = place;
      b[k] = others[next] === 0 ? -1 : place + others[next];
      force[k] = newton(levels[next], steps);
      if (b[k] < 0) {
        x[k] = points[point++] / steps.mm;
        y[k] = points[point++] / steps.mm;
      }
    }
    return { time, a, b, force, x, y };
  });
}

// Returns for each column the rows at which it changes, and its values from there on.
function readColumns(numbers, times, unit, unknown) {
  const counts = numbers.list(), gaps = numbers.list(), changes = numbers.list();
  let at = 0;
  const columns = Array.from(counts, (count) => {
    const rows = new Int32Array(count), values = new Float64Array(count);
    for (let k = 0, row = 0, value = 0; k < count; k++, at++) {
      rows[k] = row += gaps[at];
      value += changes[at];
      values[k] = value === unknown ? NaN : value * unit;
    }
    return { rows, values };
  });
  return { times, columns };
}

// Returns the last place of an ascending list whose entry is not above a value; -1: there is none.
export function lastUpTo(list, value) {
  let low = 0, high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (list[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}
