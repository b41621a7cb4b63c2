// The time that is shown: played, paused, stepped, sought.

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 30];

export class Clock extends EventTarget {
  constructor(recording) {
    super();
    this.recording = recording;
    this.time = recording.start;
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

  // seconds: of wall time since the last call. Time stands while what it needs is loading: nothing is left out.
  advance(seconds) {
    if (!this.playing || !this.recording.block(this.recording.number(this.time))) return;
    this.recording.block(this.recording.number(this.time) + 1);
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
