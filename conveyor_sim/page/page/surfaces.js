// SPDX-License-Identifier: Apache-2.0
// Surfaces of belts with a moving texture: slats across, chevrons along. Plates are plain.

export class Surfaces {
  constructor(surfaces) {
    this.surfaces = surfaces;
    this.gone = surfaces.map(() => 0); // distance that each drawn surface has moved, m
    // Of parallel surfaces of one belt, only the one with its name has arrows.
    this.plain = surfaces.map((one) => !one.named && surfaces.some((other) => other.named && parallel(one, other)));
  }

  // speeds: of the belt of each surface, m/s; seconds: simulated time since the last frame.
  advance(speeds, seconds) {
    this.surfaces.forEach(({ ratio }, i) => {
      this.gone[i] += ratio * (speeds[i] ?? 0) * seconds;
    });
  }

  draw(context, camera, colours, speeds) {
    this.surfaces.forEach((surface, i) => {
      context.beginPath();
      surface.outline.forEach(([x, y], k) => context[k ? "lineTo" : "moveTo"](camera.toX(x), camera.toY(y)));
      context.closePath();
      context.fillStyle = colours.belt;
      context.fill();
      context.lineWidth = 1;
      context.strokeStyle = colours.beltEdge;
      context.stroke();
      if (surface.belt !== null && seen(surface, camera)) this._texture(context, camera, colours, surface, this.gone[i], this.plain[i] ? null : speeds[i] ?? 0);
    });
  }

  // speed: null without arrows.
  _texture(context, camera, colours, surface, gone, speed) {
    const pitch = slatPitch(camera.scale), length = lengthOf(surface);
    if (pitch) {
      context.beginPath();
      for (let s = mod(gone, pitch); s < length; s += pitch) {
        for (const [across, move] of [[0, "moveTo"], [surface.width, "lineTo"]]) context[move](...place(surface, camera, s, across));
      }
      context.strokeStyle = colours.slat;
      context.lineWidth = 1;
      context.stroke();
    }
    const size = Math.min(0.5 * surface.width, 16 / camera.scale), rows = Math.min(6, Math.max(1, Math.round(surface.width / (6 * size))));
    const spacing = Math.max(5 * size, 70 / camera.scale), sign = Math.sign(speed) || 1;
    if (speed === null || size * camera.scale < 3) return;
    context.beginPath();
    for (let row = 0; row < rows; row++) {
      const middle = ((row + 0.5) / rows) * surface.width;
      for (let s = mod(gone, spacing); s < length; s += spacing) {
        const tail = s - sign * 0.25 * size, tip = s + sign * 0.25 * size;
        if (tail < 0 || tip < 0 || tail > length || tip > length) continue;
        context.moveTo(...place(surface, camera, tail, middle - 0.5 * size));
        context.lineTo(...place(surface, camera, tip, middle));
        context.lineTo(...place(surface, camera, tail, middle + 0.5 * size));
      }
    }
    context.strokeStyle = colours.chevron;
    context.globalAlpha = speed === 0 ? 0.25 : 0.9;
    context.lineWidth = 1.5;
    context.stroke();
    context.globalAlpha = 1;
  }
}

// Returns true if two surfaces of a belt move side by side.
export function parallel(one, other) {
  if (one.name !== other.name || one.kind !== other.kind) return false;
  const same = (a, b) => Math.abs(a - b) < 1e-6, cos = Math.cos(one.angle), sin = Math.sin(one.angle);
  if (one.kind !== "straight") return [0, 1].every((k) => same(one.centre[k], other.centre[k])) && same(one.start, other.start) && same(one.span, other.span);
  const along = ({ corner }) => corner[0] * cos + corner[1] * sin;
  return same(one.angle, other.angle) && same(one.length, other.length) && same(along(one), along(other));
}

const mod = (a, b) => ((a % b) + b) % b;

function slatPitch(scale) {
  return [0.025, 0.05, 0.1, 0.2].find((pitch) => pitch * scale >= 10) ?? 0;
}

function lengthOf(surface) {
  return surface.kind === "straight" ? surface.length : surface.span * (surface.inner + surface.width / 2);
}

// Return a point of a surface in pixels. s: distance along its centre line; across: from its right edge.
function place(surface, camera, s, across) {
  if (surface.kind === "straight") {
    const cos = Math.cos(surface.angle), sin = Math.sin(surface.angle);
    return [camera.toX(surface.corner[0] + cos * s - sin * across), camera.toY(surface.corner[1] + sin * s + cos * across)];
  }
  const swept = s / (surface.inner + surface.width / 2), angle = surface.start + (surface.clockwise ? surface.span - swept : swept);
  const radius = surface.inner + (surface.clockwise ? across : surface.width - across);
  return [camera.toX(surface.centre[0] + radius * Math.cos(angle)), camera.toY(surface.centre[1] + radius * Math.sin(angle))];
}

function seen(surface, camera) {
  const xs = surface.outline.map(([x]) => camera.toX(x)), ys = surface.outline.map(([, y]) => camera.toY(y));
  return Math.max(...xs) > 0 && Math.min(...xs) < camera.width && Math.max(...ys) > 0 && Math.min(...ys) < camera.height;
}
