// SPDX-License-Identifier: Apache-2.0
// The displayed time of a running line: now, unless the user looks back.

import { Clock } from "./clock.js";

const NEAR = 1e-6; // s

export class LiveClock extends Clock {
  constructor(recording) {
    super(recording);
    this.follow();
  }

  // Follows the present from now on.
  follow() {
    this.live = this.playing = true;
    this.time = this.recording.end;
    this._changed();
  }

  seek(time) {
    if (time >= this.recording.end - NEAR) {
      this.follow();
      return;
    }
    if (this.live) this.playing = this.live = false;
    super.seek(time);
  }

  play() {
    this.playing = true;
    this._changed();
  }

  pause() {
    this.live = false;
    super.pause();
  }

  step(frames) {
    this.live = false;
    return super.step(frames);
  }

  advance(seconds) {
    const { recording } = this;
    if (!this.live) {
      if (this.time < recording.start) this.time = recording.start; // earlier data has been dropped
      const wasPlaying = this.playing;
      super.advance(seconds);
      if (wasPlaying && !this.playing) this.follow();
    } else if (this.time !== recording.end) {
      this.time = recording.end;
      this._changed();
    }
  }
}
