// SPDX-License-Identifier: Apache-2.0
// Names on the plan without overlaps. Important names are placed first. A name without room at its object stands farther
// away with a leader line, or is left out.

const PLACES = [[0, -1], [0, 1], [1, 0], [-1, 0], [1, -1], [-1, -1], [1, 1], [-1, 1]];
const GAP = 5, HEIGHT = 16;
const SURE = 6; // names of this importance may cover small objects rather than stand elsewhere
const FAN = Array.from({ length: 16 }, (_, i) => [Math.cos((i * Math.PI) / 8), Math.sin((i * Math.PI) / 8)].map((part) => +part.toFixed(3)));
const BESIDE = 0.6; // least cosine between the place of a distant name and that across its object
const RING = 20; // px by which each further ring of places is away
const RINGS = [0, 0, 3, 4, 6, 6, 8]; // rings with a leader line by importance
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

// Returns true if a segment [x, y, x, y] has a point in a box: the part of it that lies in both ranges is not empty.
function crosses([ax, ay, bx, by], box) {
  let first = 0, last = 1;
  for (const [from, to, low, high] of [[ax, bx, box[0], box[2]], [ay, by, box[1], box[3]]]) {
    if (from === to && (from < low || from > high)) return false;
    if (from === to) continue;
    const [one, other] = [(low - from) / (to - from), (high - from) / (to - from)];
    [first, last] = [Math.max(first, Math.min(one, other)), Math.min(last, Math.max(one, other))];
  }
  return first <= last;
}

// Returns true if two segments [x, y, x, y] intersect.
function cut([ax, ay, bx, by], [cx, cy, dx, dy]) {
  const side = (x, y, fromX, fromY, toX, toY) => Math.sign((toX - fromX) * (y - fromY) - (toY - fromY) * (x - fromX));
  return side(ax, ay, cx, cy, dx, dy) !== side(bx, by, cx, cy, dx, dy) && side(cx, cy, ax, ay, bx, by) !== side(dx, dy, ax, ay, bx, by);
}

export class Labels {
  constructor() {
    this.wanted = [];
    this.kept = []; // boxes without names, px
    this.before = new Map(); // last place of each name, so that names stay in place while values change
    this.scale = 0; // px per metre of these places
  }

  clear() {
    this.wanted.length = this.kept.length = 0;
  }

  // Keeps a square around a point free of names, px.
  keepOff(x, y, half) {
    this.kept.push([x - half, y - half, x + half, y + half]);
  }

  // of: key of the object; x, y: px; reach: px between the point and the name; call for the most important names first.
  // towards: best of PLACES; a place across to it lies on the named object.
  add(of, text, x, y, { importance = 0, reach = 6, colour = null, bold = false, towards = null } = {}) {
    this.wanted.push({ of, text, x, y, importance, reach, colour, bold, towards, places: towards ? placesTowards(towards) : PLACES });
  }

  // covered: boxes without names, px.
  draw(context, camera, colours, covered) {
    const boxes = [...covered], lines = [], placed = [], now = new Map();
    if (this.scale !== camera.scale) this.before.clear();
    this.scale = camera.scale;
    context.textBaseline = "middle";
    context.textAlign = "center";
    context.lineJoin = "round";
    for (const label of this.wanted.sort((a, b) => b.importance - a.importance)) {
      if (label.x < 0 || label.y < 0 || label.x > camera.width || label.y > camera.height) continue;
      context.font = label.font = `${label.bold ? "600 " : ""}12px system-ui, sans-serif`;
      const place = this._place(label, context.measureText(label.text).width + 6, camera, boxes, lines);
      if (!place) continue;
      boxes.push(place.box);
      if (place.line) lines.push(place.line);
      now.set(label.of, [place.dx, place.dy, place.ring]);
      placed.push({ ...label, ...place });
    }
    this.before = now;
    for (const { line, colour } of placed) if (line) drawLeader(context, line, colour ?? colours.ink, colours.halo);
    for (const { text, font, colour, box } of placed) {
      const x = (box[0] + box[2]) / 2, y = (box[1] + box[3]) / 2;
      context.font = font;
      context.strokeStyle = colours.halo;
      context.lineWidth = 4;
      context.strokeText(text, x, y);
      context.fillStyle = colour ?? colours.ink;
      context.fillText(text, x, y);
    }
  }

  // Returns the best free place: box, direction, ring and leader line, null at the object; null if there is none.
  _place(label, width, camera, boxes, lines) {
    const rings = RINGS[Math.min(label.importance, RINGS.length - 1)], last = this.before.get(label.of);
    if (last) {
      const place = this._tried(label, width, camera, boxes, lines, ...last);
      if (place) return place;
    }
    const [[ax, ay]] = label.places, across = ([x, y]) => (ax * x + ay * y) / Math.hypot(ax, ay);
    const fan = FAN.filter((place) => !label.towards || Math.abs(across(place)) > BESIDE).sort((one, other) => across(other) - across(one)); // best first
    for (let ring = 0; ring <= rings; ring++) for (const [dx, dy] of ring ? fan : label.places) {
      const place = this._tried(label, width, camera, boxes, lines, dx, dy, ring);
      if (place) return place;
    }
    return null;
  }

  // Returns a place if it is free, else null.
  _tried(label, width, camera, boxes, lines, dx, dy, ring) {
    const far = label.reach + GAP + ring * RING, beside = label.x + dx * far + (Math.sign(dx) * width) / 2;
    const x = dx ? beside : Math.min(camera.width - width / 2, Math.max(width / 2, beside)), y = label.y + dy * (far + HEIGHT / 2);
    const box = [x - width / 2, y - HEIGHT / 2, x + width / 2, y + HEIGHT / 2];
    if (box[0] < 0 || box[1] < 0 || box[2] > camera.width || box[3] > camera.height || boxes.some((other) => meet(box, other))) return null;
    if ((ring || label.importance < SURE) && this.kept.some((other) => meet(box, other))) return null;
    if (lines.some((other) => crosses(other, box))) return null;
    if (!ring) return { box, dx, dy, ring, line: null };
    const line = [label.x, label.y, Math.min(box[2], Math.max(box[0], label.x)), Math.min(box[3], Math.max(box[1], label.y))];
    if (boxes.some((other) => crosses(line, other)) || lines.some((other) => cut(line, other))) return null;
    return { box, dx, dy, ring, line };
  }
}

function drawLeader(context, [ax, ay, bx, by], colour, halo) {
  for (const [width, style] of [[3, halo], [1.25, colour]]) {
    context.beginPath();
    context.moveTo(ax, ay);
    context.lineTo(bx, by);
    context.lineWidth = width;
    context.strokeStyle = style;
    context.stroke();
  }
  context.beginPath();
  context.arc(ax, ay, 2.5, 0, 2 * Math.PI);
  context.fillStyle = colour;
  context.fill();
}
