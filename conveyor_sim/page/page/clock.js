// SPDX-License-Identifier: Apache-2.0
// The displayed time: playing, paused, stepped or sought.

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 30];

export class Clock extends EventTarget {
  // other: a second recording, shown at the same time. The longer recording determines the range of times.
  constructor(recording, other = null) {
    super();
    this.all = other ? [recording, other] : [recording];
    this.recording = other && other.end > recording.end ? other : recording;
    this.time = this.recording.start;
    this.playing = false;
    this.speed = 1;
  }

  seek(time) {
    this.time = Math.min(this.recording.end, Math.max(this.recording.start, time));
    this._changed();
  }

  play() {
    if (this.time >= this.recording.end - 1e-9) this.time = this.recording.start;
    this.playing = true;
    this._changed();
  }

  pause() {
    this.playing = false;
    this._changed();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  async step(frames) {
    this.playing = false;
    const time = await this.recording.stepped(this.time, frames);
    if (time !== null) this.time = time;
    this._changed();
  }

  setSpeed(speed) {
    this.speed = speed;
    this._changed();
  }

  faster(by) {
    const next = SPEEDS.indexOf(this.speed) + by;
    this.setSpeed(SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, next))]);
  }

  // seconds: wall time since the last call. Time stands while data is loading, so no frame is left out.
  advance(seconds) {
    const there = (ahead) => this.all.map((one) => one.block(one.number(this.time) + ahead));
    if (!this.playing || there(0).includes(null)) return;
    there(1);
    this.time += seconds * this.speed;
    if (this.time >= this.recording.end) {
      this.time = this.recording.end;
      this.playing = false;
    }
    this._changed();
  }

  _changed() {
    this.dispatchEvent(new Event("change"));
  }
}
