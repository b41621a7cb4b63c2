// Names on the plan without overlaps: the least important names are left out where there is no room.

const PLACES = [[0, -1], [0, 1], [1, 0], [-1, 0], [1, -1], [-1, -1], [1, 1], [-1, 1]];
const GAP = 5;
const SURE = 6; // names of this importance may cover small objects rather than stand elsewhere
const snapped = (part) => (Math.abs(part) < Math.sin(Math.PI / 8) ? 0 : Math.sign(part));

const placesTowards = ([x, y]) => [[x, y], [-x, -y], ...PLACES.filter(([dx, dy]) => dx * x + dy * y)];

// Returns the place in a direction of the plan (rad).
export const outside = (angle) => [snapped(Math.cos(angle)), snapped(-Math.sin(angle))];

// Returns the place along a line, whatever its direction: up before down, right before left.
export function placeAt(angle) {
  const [dx, dy] = outside(angle);
  return dy > 0 || (dy === 0 && dx < 0) ? [-dx, -dy] : [dx, dy];
}

const meet = (one, other) => one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3];

export class Labels {
  constructor() {
    this.wanted = [];
    this.kept = []; // boxes without names, px
  }

  clear() {
    this.wanted.length = this.kept.length = 0;
  }

  // Keeps a square around a point free of names, px.
  keepOff(x, y, half) {
    this.kept.push([x - half, y - half, x + half, y + half]);
  }

  // x, y: px; reach: px between the point and the name; call for the most important names first. towards: best of PLACES; a
  // place across to it lies on the named object.
  add(text, x, y, { importance = 0, reach = 6, colour = null, bold = false, towards = null } = {}) {
    this.wanted.push({ text, x, y, importance, reach, colour, bold, places: towards ? placesTowards(towards) : PLACES });
  }

  // covered: boxes without names, px.
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
