// Names on the plan that keep out of each other's way: those that find no room are left out, the least important first.

const PLACES = [[0, -1], [0, 1], [1, 0], [-1, 0], [1, -1], [-1, -1], [1, 1], [-1, 1]];
const GAP = 5;

export class Labels {
  constructor() {
    this.wanted = [];
  }

  clear() {
    this.wanted.length = 0;
  }

  // x, y: px; reach: px from there to where it may stand; the most important first.
  add(text, x, y, { importance = 0, reach = 6, colour = null, bold = false } = {}) {
    this.wanted.push({ text, x, y, importance, reach, colour, bold });
  }

  draw(context, camera, colours) {
    const taken = [];
    context.textBaseline = "middle";
    context.textAlign = "center";
    context.lineJoin = "round";
    for (const label of this.wanted.sort((a, b) => b.importance - a.importance)) {
      if (label.x < -50 || label.y < -20 || label.x > camera.width + 50 || label.y > camera.height + 20) continue;
      context.font = `${label.bold ? "600 " : ""}12px system-ui, sans-serif`;
      const width = context.measureText(label.text).width + 6, height = 16;
      for (const [dx, dy] of PLACES) {
        const beside = label.x + dx * (label.reach + GAP + width / 2);
        const x = dy ? Math.min(camera.width - width / 2, Math.max(width / 2, beside)) : beside, y = label.y + dy * (label.reach + GAP + height / 2);
        const box = [x - width / 2, y - height / 2, x + width / 2, y + height / 2];
        const outside = box[0] < 0 || box[1] < 0 || box[2] > camera.width || box[3] > camera.height;
        if (outside || taken.some((other) => box[0] < other[2] && other[0] < box[2] && box[1] < other[3] && other[1] < box[3])) continue;
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
