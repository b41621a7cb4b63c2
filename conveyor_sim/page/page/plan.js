// SPDX-License-Identifier: Apache-2.0
// The plan: the line at a moment, drawn in one pass over the canvas.

import { Surfaces, parallel } from "./surfaces.js";
import { COLOURINGS, palette } from "./colours.js";
import { Crowd, MANY } from "./crowd.js";
import { CHOSEN, drawAreas, drawBodies, drawLines, drawMovers } from "./devices.js";
import { byId, short } from "./dom.js";
import { Labels, outside, placeAt } from "./labels.js";
import { drawSelection, outlinesOf } from "./selection.js";
import { drawUnderlay } from "./underlay.js";

const CLEAR = "transparent"; // bottles over a heat map are outlines, which leave its colours as they are
const WIDTHS = 6; // widths of contact lines

export class Plan {
  constructor(canvas, view) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.view = view;
    this.surfaces = new Surfaces(view.recording.head.surfaces);
    this.labels = view.labels = new Labels();
    this.sprites = [];
    this.crowd = new Crowd();
    this.look = ""; // look for which the sprites were made
    this.last = null; // time of the last frame
    this.frame = null;
    this.covered = [];
    this.said = ""; // text over the plan
  }

  // Elements over the plan, which must cover no names.
  cover() {
    const { left, top } = this.canvas.getBoundingClientRect(), over = byId("stage").querySelectorAll("#legend, #zoom, #map:not([hidden]), #news:not(.none), .caption");
    this.covered = Array.from(over, (one) => one.getBoundingClientRect()).map((box) => [box.left - left, box.top - top, box.right - left, box.bottom - top]);
    this.said = byId("notice").textContent;
  }

  resize() {
    const ratio = devicePixelRatio || 1, { clientWidth, clientHeight } = this.canvas;
    this.canvas.width = Math.round(clientWidth * ratio);
    this.canvas.height = Math.round(clientHeight * ratio);
    this.ratio = ratio;
    this.look = "";
    this.cover();
    this.view.camera.resize(clientWidth, clientHeight);
  }

  // Returns the frame to draw; while it loads, the last one.
  update() {
    const { clock, recording } = this.view;
    this.frame = recording.frame(clock.time, clock.playing) ?? this.frame;
  }

  draw() {
    const { view, context, frame } = this, { camera, clock, recording } = view, colours = palette();
    const speeds = recording.head.surfaces.map(({ belt }) => (belt === null ? 0 : recording.at("belts", belt, clock.time) ?? 0)); // of their belts
    const gone = this.last === null ? 0 : clock.time - this.last;
    if (Math.abs(gone) < 1) this.surfaces.advance(speeds, gone);
    this.last = clock.time;
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.fillStyle = colours.paper;
    context.fillRect(0, 0, camera.width, camera.height);
    this.labels.clear();
    if (this.said !== byId("notice").textContent) this.cover();
    drawUnderlay(context, camera, colours, recording.head.underlay, () => view.touch());
    this.surfaces.draw(context, camera, colours, speeds);
    view.heat.draw(context, camera);
    drawAreas(context, camera, colours, view);
    this._rails(colours);
    if (view.device) drawSelection(context, camera, colours, outlinesOf(view, view.device));
    view.wear.draw(context, camera);
    if (frame) this._bottles(frame, colours);
    if (frame && view.showForces) this._forces(frame, colours);
    drawMovers(context, camera, colours, view);
    drawBodies(context, camera, colours, view);
    drawLines(context, camera, colours, view);
    this._beltNames(colours, speeds);
    if (frame) this._selected(frame, colours);
    if (view.showNames) this.labels.draw(context, camera, colours, this.covered);
  }

  _rails(colours) {
    const { context, view: { camera, recording } } = this;
    context.beginPath();
    for (const rail of recording.head.rails) {
      rail.forEach(([x, y], k) => context[k ? "lineTo" : "moveTo"](camera.toX(x), camera.toY(y)));
    }
    context.lineJoin = context.lineCap = "round";
    context.lineWidth = Math.max(2, 0.008 * camera.scale);
    context.strokeStyle = colours.rail;
    context.stroke();
    context.lineCap = "butt";
  }

  _bottles(frame, colours) {
    const { context, view } = this, { camera, recording: { head } } = view, colouring = COLOURINGS[view.colouring];
    const look = `${camera.scale} ${colours.edge}`;
    if (this.look !== look) [this.look, this.sprites] = [look, head.types.map(() => new Map())];
    const crowd = frame.bottles.length >= MANY ? this.crowd : null, { ratio } = this;
    crowd?.begin(this.canvas.width, this.canvas.height);
    for (const bottle of frame.bottles) {
      const x = camera.toX(bottle.x), y = camera.toY(bottle.y), radius = head.types[bottle.type].radius * camera.scale;
      if (x < -radius || y < -radius || x > camera.width + radius || y > camera.height + radius) continue;
      const colour = view.shownHeat ? CLEAR : colouring.of(bottle, view), crossed = colouring.crossed?.(bottle, view) ?? false;
      if (radius < 1.5) {
        context.fillStyle = colour;
        context.fillRect(x - radius, y - radius, 2 * radius, 2 * radius);
      } else if (radius < 60) {
        const { image, half } = this._sprite(this.sprites[bottle.type], colour, radius, colours.edge, crossed);
        if (!crowd?.add(image, (x - half) * ratio, (y - half) * ratio)) context.drawImage(image, x - half, y - half, 2 * half, 2 * half);
      } else this._circle(context, x, y, radius, colour, colours.edge, crossed);
      if (radius > 16) this.labels.add(`number ${bottle.id}`, `${bottle.id}`, x, y - radius - 4, { importance: 1, reach: -11 });
    }
    crowd?.draw(context, camera.width, camera.height);
  }

  _circle(context, x, y, radius, colour, edge, crossed) {
    context.beginPath();
    context.arc(x, y, Math.max(0.5, radius - 0.5), 0, 2 * Math.PI);
    context.fillStyle = colour;
    context.fill();
    context.lineWidth = 1;
    context.strokeStyle = edge;
    context.stroke();
    if (crossed) {
      const reach = 0.7 * radius; // as far as the edge
      context.beginPath();
      for (const side of [-1, 1]) {
        context.moveTo(x - reach, y - side * reach);
        context.lineTo(x + reach, y + side * reach);
      }
      context.lineWidth = Math.max(1.5, 0.12 * radius);
      context.stroke();
    } else if (radius > 6) {
      context.beginPath();
      context.arc(x, y, radius * 0.45, 0, 2 * Math.PI); // the neck
      context.globalAlpha = 0.35;
      context.stroke();
      context.globalAlpha = 1;
    }
  }

  // Returns the sprite of a bottle. Copying it takes a fraction of drawing it. Sprites are cached while the scale stays.
  _sprite(sprites, colour, radius, edge, crossed) {
    const key = crossed ? `${colour} crossed` : colour, found = sprites.get(key);
    if (found) return found;
    const reach = Math.ceil(radius) + 1, size = Math.ceil(2 * reach * this.ratio), canvas = new OffscreenCanvas(size, size);
    const context = canvas.getContext("2d"), half = size / 2 / this.ratio;
    context.scale(this.ratio, this.ratio);
    this._circle(context, half, half, radius, colour, edge, crossed);
    const sprite = { image: canvas.transferToImageBitmap(), half };
    sprites.set(key, sprite);
    return sprite;
  }

  _forces(frame, colours) {
    const { context, view } = this, { camera } = view, { contacts, bottles, places } = frame;
    if (!contacts) return;
    const paths = Array.from({ length: WIDTHS }, () => new Path2D());
    for (let i = 0; i < contacts.force.length; i++) {
      const a = bottles[places[contacts.a[i]]], b = contacts.b[i] < 0 ? null : bottles[places[contacts.b[i]]];
      if (!a || (contacts.b[i] >= 0 && !b) || contacts.force[i] <= 0) continue;
      const share = Math.sqrt(contacts.force[i] / view.strongest);
      const path = paths[Math.min(WIDTHS - 1, Math.floor(share * WIDTHS))];
      path.moveTo(camera.toX(a.x), camera.toY(a.y));
      path.lineTo(camera.toX(b ? b.x : contacts.x[i]), camera.toY(b ? b.y : contacts.y[i]));
    }
    context.strokeStyle = colours.force;
    context.lineCap = "round";
    const radius = Math.max(...view.recording.head.types.map((type) => type.radius)) * camera.scale;
    const unit = Math.min(2, Math.max(0.25, radius / 14)); // so that bottles remain visible under the lines
    paths.forEach((path, i) => {
      context.lineWidth = (0.6 + 1.1 * i) * unit;
      context.stroke(path);
    });
    context.lineCap = "butt";
  }

  _beltNames(colours, speeds) {
    const { camera, recording: { head } } = this.view;
    head.surfaces.forEach((belt, i) => {
      if (!belt.named) return;
      const angle = belt.start + belt.span / 2, radius = belt.inner + belt.width / 2;
      const [x, y] = belt.kind === "straight"
        ? [0, 1].map((k) => (belt.outline[0][k] + belt.outline[2][k]) / 2)
        : [belt.centre[0] + radius * Math.cos(angle), belt.centre[1] + radius * Math.sin(angle)];
      const beside = head.surfaces.filter((other) => other === belt || parallel(other, belt)).map((other) => this._across(belt, other));
      const towards = belt.kind === "straight" ? placeAt(belt.angle + Math.PI / 2) : outside(angle);
      const device = `belts/${belt.name}`;
      this.labels.add(device, `${short(belt.name)} ${speeds[i].toFixed(2)} m/s`, camera.toX(x), camera.toY(y), {
        importance: this.view.device === device ? CHOSEN : 3, reach: Math.min(60, Math.max(...beside) * camera.scale), colour: colours.muted,
        towards,
      });
    });
  }

  // Returns the distance of the far edge of a parallel surface from the middle of a belt, m.
  _across(belt, other) {
    const apart = belt.kind === "straight"
      ? (other.corner[1] - belt.corner[1]) * Math.cos(belt.angle) - (other.corner[0] - belt.corner[0]) * Math.sin(belt.angle)
      : other.inner - belt.inner;
    return Math.max(Math.abs(apart - belt.width / 2), Math.abs(apart + other.width - belt.width / 2));
  }

  _selected(frame, colours) {
    const { context, view } = this, { camera, recording, clock } = view;
    if (view.bottle === null) return;
    const points = recording.trace(view.bottle, clock.time - 10, clock.time);
    context.beginPath();
    points.forEach(({ x, y }, k) => context[k ? "lineTo" : "moveTo"](camera.toX(x), camera.toY(y)));
    context.lineWidth = 2.5;
    context.strokeStyle = colours.select;
    context.stroke();
    const bottle = frame.bottles.find(({ id }) => id === view.bottle);
    if (!bottle) return;
    const radius = recording.head.types[bottle.type].radius * camera.scale;
    context.beginPath();
    context.arc(camera.toX(bottle.x), camera.toY(bottle.y), radius + 4, 0, 2 * Math.PI);
    context.lineWidth = 3;
    context.stroke();
    this.labels.add("bottle", `bottle ${bottle.id}`, camera.toX(bottle.x), camera.toY(bottle.y), { importance: 9, reach: radius + 4, colour: colours.select, bold: true });
  }

  // Returns the bottle, or else the device, at a point of the canvas.
  bottleAt(px, py) {
    const { camera, recording: { head } } = this.view;
    let best = null, least = Infinity;
    for (const bottle of this.frame?.bottles ?? []) {
      const far = Math.hypot(camera.toX(bottle.x) - px, camera.toY(bottle.y) - py) - head.types[bottle.type].radius * camera.scale;
      if (far < Math.min(least, 4)) [best, least] = [bottle.id, far];
    }
    return best;
  }
}
