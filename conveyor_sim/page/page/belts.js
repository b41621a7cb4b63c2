// Belts with a moving texture: slats across, chevrons along.

export class Belts {
  constructor(belts) {
    this.belts = belts;
    this.gone = belts.map(() => 0); // distance that each drawn surface has moved, m
  }

  // seconds: simulated time since the last frame.
  advance(speeds, seconds) {
    this.belts.forEach((_, i) => {
      this.gone[i] += (speeds[i] ?? 0) * seconds;
    });
  }

  draw(context, camera, colours, speeds) {
    this.belts.forEach((belt, i) => {
      context.beginPath();
      belt.outline.forEach(([x, y], k) => context[k ? "lineTo" : "moveTo"](camera.toX(x), camera.toY(y)));
      context.closePath();
      context.fillStyle = colours.belt;
      context.fill();
      context.lineWidth = 1;
      context.strokeStyle = colours.beltEdge;
      context.stroke();
      if (seen(belt, camera)) this._texture(context, camera, colours, belt, this.gone[i], speeds[i] ?? 0);
    });
  }

  _texture(context, camera, colours, belt, gone, speed) {
    const pitch = slatPitch(camera.scale), length = lengthOf(belt);
    if (pitch) {
      context.beginPath();
      for (let s = mod(gone, pitch); s < length; s += pitch) {
        for (const [across, move] of [[0, "moveTo"], [belt.width, "lineTo"]]) context[move](...place(belt, camera, s, across));
      }
      context.strokeStyle = colours.slat;
      context.lineWidth = 1;
      context.stroke();
    }
    const size = Math.min(0.5 * belt.width, 16 / camera.scale), rows = Math.min(6, Math.max(1, Math.round(belt.width / (6 * size))));
    const spacing = Math.max(5 * size, 70 / camera.scale), sign = Math.sign(speed) || 1;
    if (size * camera.scale < 3) return;
    context.beginPath();
    for (let row = 0; row < rows; row++) {
      const middle = ((row + 0.5) / rows) * belt.width;
      for (let s = mod(gone, spacing); s < length; s += spacing) {
        const tail = s - sign * 0.25 * size, tip = s + sign * 0.25 * size;
        if (tail < 0 || tip < 0 || tail > length || tip > length) continue;
        context.moveTo(...place(belt, camera, tail, middle - 0.5 * size));
        context.lineTo(...place(belt, camera, tip, middle));
        context.lineTo(...place(belt, camera, tail, middle + 0.5 * size));
      }
    }
    context.strokeStyle = colours.chevron;
    context.globalAlpha = speed === 0 ? 0.25 : 0.9;
    context.lineWidth = 1.5;
    context.stroke();
    context.globalAlpha = 1;
  }
}

const mod = (a, b) => ((a % b) + b) % b;

function slatPitch(scale) {
  return [0.025, 0.05, 0.1, 0.2].find((pitch) => pitch * scale >= 10) ?? 0;
}

function lengthOf(belt) {
  return belt.kind === "straight" ? belt.length : belt.span * (belt.inner + belt.width / 2);
}

// Return a point of a belt in pixels. s: distance along its centre line; across: from its right edge (inner edge of a curve).
function place(belt, camera, s, across) {
  if (belt.kind === "straight") {
    const cos = Math.cos(belt.angle), sin = Math.sin(belt.angle);
    return [camera.toX(belt.corner[0] + cos * s - sin * across), camera.toY(belt.corner[1] + sin * s + cos * across)];
  }
  const angle = belt.start + s / (belt.inner + belt.width / 2), radius = belt.inner + belt.width - across;
  return [camera.toX(belt.centre[0] + radius * Math.cos(angle)), camera.toY(belt.centre[1] + radius * Math.sin(angle))];
}

function seen(belt, camera) {
  const xs = belt.outline.map(([x]) => camera.toX(x)), ys = belt.outline.map(([, y]) => camera.toY(y));
  return Math.max(...xs) > 0 && Math.min(...xs) < camera.width && Math.max(...ys) > 0 && Math.min(...ys) < camera.height;
}
