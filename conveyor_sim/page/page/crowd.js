// SPDX-License-Identifier: Apache-2.0
// Thousands of bottles: their pixels are copied into one image, which is drawn at once. Single drawings take longer.

export const MANY = 2000; // least number of bottles for which it is faster

export class Crowd {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.stamps = new WeakMap();
  }

  begin(...size) {
    const [width, height] = size.map((side) => Math.max(side, 1)); // a plan without room has no image otherwise
    if (this.canvas.width !== width || this.canvas.height !== height || !this.data) {
      [this.canvas.width, this.canvas.height] = [width, height];
      this.context = this.canvas.getContext("2d");
      this.data = this.context.createImageData(width, height);
      this.pixels = new Uint32Array(this.data.data.buffer);
    }
    this.pixels.fill(0);
  }

  // x, y: px of the image, corner of the sprite; returns false if it exceeds the image and must be drawn separately.
  add(image, x, y) {
    const left = Math.round(x), top = Math.round(y), { width, height } = this.canvas;
    if (left < 0 || top < 0 || left + image.width > width || top + image.height > height) return false;
    const { places, colours } = this._stamp(image), at = top * width + left, { pixels } = this;
    for (let i = 0; i < places.length; i++) pixels[at + places[i]] = colours[i];
    return true;
  }

  draw(context, width, height) {
    this.context.putImageData(this.data, 0, 0);
    context.drawImage(this.canvas, 0, 0, width, height);
  }

  // Returns the opaque pixels of a sprite, as offsets from its corner in this image.
  _stamp(image) {
    let stamp = this.stamps.get(image);
    if (!stamp || stamp.width !== this.canvas.width) {
      const canvas = new OffscreenCanvas(image.width, image.height), context = canvas.getContext("2d");
      context.drawImage(image, 0, 0);
      const all = new Uint32Array(context.getImageData(0, 0, image.width, image.height).data.buffer), found = [];
      all.forEach((pixel, i) => {
        if (pixel >>> 24 > 127) found.push([Math.floor(i / image.width) * this.canvas.width + (i % image.width), (pixel | 0xff000000) >>> 0]);
      });
      stamp = { width: this.canvas.width, places: Int32Array.from(found, ([place]) => place), colours: Uint32Array.from(found, ([, colour]) => colour) };
      this.stamps.set(image, stamp);
    }
    return stamp;
  }
}
