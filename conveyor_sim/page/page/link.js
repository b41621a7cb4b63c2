// SPDX-License-Identifier: Apache-2.0
// Links to a moment: "#t=84&bottle=31&device=machines/capper" at the end of the address.

import { seconds, warn } from "./dom.js";

const AFTER = 400; // ms without a change after which the address is updated

export class Link {
  constructor(view) {
    this.view = view;
    this.opened = null; // time at which the page has opened
    this.written = "";
    this.timer = 0;
    addEventListener("hashchange", () => this.follow());
  }

  // Goes to the moment of the address and shows what is wrong with it. Returns true if it states a time.
  follow() {
    const { view } = this, { clock } = view, stated = new URLSearchParams(location.hash.slice(1)), wrong = [];
    const { start, end } = clock.recording, time = this._number(stated, "t"), bottle = this._number(stated, "bottle");
    if (time !== null && !(time >= start - 1e-6 && time <= end + 1e-6)) wrong.push(`t=${stated.get("t")}, expected a time from ${seconds(start)} to ${seconds(end)}`);
    if (bottle !== null && !(Number.isInteger(bottle) && bottle >= 0)) wrong.push(`bottle=${stated.get("bottle")}, expected the id of a bottle`);
    const device = stated.get("device");
    if (device !== null && !view.faceplate.devices.includes(device)) wrong.push(`device=${device}, which this line does not have`);
    if (wrong.length) {
      warn(`The address has ${wrong.join("; ")}`);
      return false;
    }
    if (device !== null) {
      view.selectDevice(device);
      view.tabs.show("device");
    }
    if (bottle !== null) view.selectBottle(bottle);
    if (time !== null) {
      clock.pause();
      clock.seek(time);
      view.snap();
    }
    return time !== null;
  }

  // Returns a number of the address; null if it is absent, NaN if it is no number.
  _number(stated, name) {
    const text = stated.get(name);
    return text === null ? null : text.trim() === "" ? NaN : Number(text);
  }

  // Writes the displayed moment into the address once the time stands.
  update() {
    const { view, opened } = this, { clock } = view, now = Object.entries({
      t: clock.live || clock.time === opened ? null : +clock.time.toFixed(3), bottle: view.bottle, device: view.device,
    }).filter(([, value]) => value !== null);
    if (clock.playing && !clock.live) return;
    const hash = now.map(([name, value]) => `${name}=${encodeURIComponent(value).replaceAll("%2F", "/")}`).join("&");
    if (hash === this.written) return;
    this.written = hash;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => history.replaceState(null, "", hash ? `#${hash}` : location.href.split("#")[0]), AFTER);
  }
}
