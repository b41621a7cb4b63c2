// Names on the plan that keep out of each other's way: those that find no room are left out, the least important first.

const PLACES = [[0, -1], [0, 1], [1, 0], [-1, 0], [1, -1], [-1, -1], [1, 1], [-1, 1]];
const GAP = 5;
const SURE = 6; // of this importance, rather over a small thing than elsewhere
const snapped = (part) => (Math.abs(part) < Math.sin(Math.PI / 8) ? 0 : Math.sign(part));

const placesTowards = ([x, y]) => [[x, y], [-x, -y], ...PLACES.filter(([dx, dy]) => dx * x + dy * y)];

// The place in a direction of the plan (rad).
export const outside = (angle) => [snapped(Math.cos(angle)), snapped(-Math.sin(angle))];

// The same along a line, whichever way it runs: rather up than down, rather right than left.
export function placeAt(angle) {
  const [dx, dy] = outside(angle);
  return dy > 0 || (dy === 0 && dx < 0) ? [-dx, -dy] : [dx, dy];
}

const meet = (one, other) => one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3];

export class Labels {
  constructor() {
    this.wanted = [];
    this.kept = []; // boxes where no name is to stand, px
  }

  clear() {
    this.wanted.length = this.kept.length = 0;
  }

  // Keep names off a square around a point, px.
  keepOff(x, y, half) {
    this.kept.push([x - half, y - half, x + half, y + half]);
  }

  // x, y: px; reach: px from there to where it may stand; the most important first. towards: the best of PLACES; what lies
  // across to it is on what is named.
  add(text, x, y, { importance = 0, reach = 6, colour = null, bold = false, towards = null } = {}) {
    this.wanted.push({ text, x, y, importance, reach, colour, bold, places: towards ? placesTowards(towards) : PLACES });
  }

  // covered: boxes where none is to stand, px.
  draw(context, camera, colours, covered) {
    const taken = [...covered], hides = (box) => this.kept.some((other) => meet(box, other));
    context.textBaseline = "middle";
    context.textAlign = "center";
    context.lineJoin = "round";
    for (const label of this.wanted.sort((a, b) => b.importance - a.importance)) {
      if (label.x < -50 || label.y < -20 || label.x > camera.width + 50 || label.y > camera.height + 20) continue;
      context.font = `${label.bold ? "600 " : ""}12px system-ui, sans-serif`;
      const width = context.measureText(label.text).width + 6, height = 16;
      for (const [dx, dy] of label.places) {
        const beside = label.x + dx * (label.reach + GAP + width / 2);
        const x = dy ? Math.min(camera.width - width / 2, Math.max(width / 2, beside)) : beside, y = label.y + dy * (label.reach + GAP + height / 2);
        const box = [x - width / 2, y - height / 2, x + width / 2, y + height / 2];
        const outside = box[0] < 0 || box[1] < 0 || box[2] > camera.width || box[3] > camera.height;
        if (outside || taken.some((other) => meet(box, other)) || (label.importance < SURE && hides(box))) continue;
        taken.push(box);
        context.strokeStyle = colours.halo;
        context.lineWidth = 4;
        context.strokeText(label.text, x, y);
        context.fillStyle = label.colour ?? colours.ink;
        context.fillText(label.text, x, y);
        break;
      }
    }
  }
}
