// SPDX-License-Identifier: Apache-2.0
// Photo-eyes, zones, machines, counters, gates, pushers and diverters.

import { short } from "./dom.js";
import { outside, placeAt } from "./labels.js";
import { inside } from "./shapes.js";
import { stateColour, stateName, stateOf } from "./story.js";

const FOLDERS = {
  photo_eye: "photo_eyes", zone: "zones", counter: "counters", infeed: "infeeds", outfeed: "outfeeds", spill: "spills",
  station: "machines", source: "machines", sink: "machines", inspection: "machines", reject: "machines",
};

const LONG = 2; // regions with a larger ratio of width to height have their names above or below
export const CHOSEN = 8; // importance of the name of the selected device
const WIDE = 30; // px, half the width of a belt beyond which the name of a point stands on it
const SHOWN_BAD = 0.5; // s for which an inspection is lit after a bad bottle

export const deviceOf = (mark) => `${FOLDERS[mark.kind] ?? `${mark.kind}s`}/${mark.name}`;

// Returns colour and name of a machine's state; null: it has no states.
function doing(view, device) {
  const { state, category } = stateOf(view, device);
  return state === undefined ? null : { colour: stateColour(state, category), name: ` · ${stateName(state, category)}` };
}

export function middle(points) {
  return points.reduce((sum, [x, y]) => [sum[0] + x / points.length, sum[1] + y / points.length], [0, 0]);
}

function outline(context, camera, points, close) {
  context.beginPath();
  points.forEach(([x, y], k) => context[k ? "lineTo" : "moveTo"](camera.toX(x), camera.toY(y)));
  if (close) context.closePath();
}

export function drawAreas(context, camera, colours, view) {
  for (const mark of view.recording.head.marks) {
    if (mark.look !== "region" && mark.look !== "exit") continue;
    const device = deviceOf(mark), now = mark.look === "region" ? null : doing(view, device);
    let colour = mark.look === "region" ? colours.zone : colours.exit, share = 0.06, note = "";
    if (mark.look === "region") {
      const bottles = view.signal(`${device}/bottles`), full = view.signal(`${device}/full`);
      share = full ? 0.4 : Math.min(0.25, 0.06 + 0.01 * (bottles ?? 0));
      note = bottles === undefined ? "" : ` ${bottles}${full ? " full" : ""}`;
    } else if (now) {
      [colour, note] = [now.colour, now.name];
      share = 0.25;
    }
    outline(context, camera, mark.points, true);
    context.globalAlpha = share;
    context.fillStyle = colour;
    context.fill();
    context.globalAlpha = 1;
    context.setLineDash(mark.look === "region" ? [2, 3] : []);
    context.lineWidth = now ? 2 : 1.5;
    context.strokeStyle = colour;
    context.stroke();
    context.setLineDash([]);
    label(view, camera, mark, note, mark.look === "region" ? 3 : 6, mark.look === "region" ? colour : colours.ink);
  }
}

const belts = new WeakMap(); // by mark: the straight belt that it lies on, or null

function beltBelow({ surfaces }, mark) {
  if (!belts.has(mark)) belts.set(mark, surfaces.find(({ kind, outline }) => kind === "straight" && inside(outline, ...middle(mark.points))) ?? null);
  return belts.get(mark);
}

// Returns true if other entries stand beside an entry on its belt.
function hasNeighbour({ marks, surfaces }, mark) {
  const belt = beltBelow({ surfaces }, mark), [[x, y]] = mark.points;
  return belt !== null && marks.some((other) => other !== mark && other.look === "entry" && beltBelow({ surfaces }, other) === belt && Math.hypot(other.points[0][0] - x, other.points[0][1] - y) < belt.width);
}

// beyond: px by which the drawing exceeds its points.
function label(view, camera, mark, note, importance, colour, beyond = 0) {
  const [x, y] = middle(mark.points), isLine = mark.points.length === 2, [from, to] = mark.points;
  const far = (point) => (isLine ? Math.hypot(point[0] - x, point[1] - y) : Math.abs(point[1] - y));
  const belt = isLine ? null : beltBelow(view.recording.head, mark), half = belt ? (belt.width / 2) * camera.scale : 0;
  const reach = Math.max(mark.points.length === 1 && half < WIDE ? half : 0, Math.max(...mark.points.map(far)) * camera.scale);
  const width = Math.max(...mark.points.map((point) => Math.abs(point[0] - x))) * camera.scale;
  const towards = isLine ? placeAt(Math.atan2(to[1] - from[1], to[0] - from[0])) // behind the end of a beam
    : width > LONG * reach ? [0, -1] : belt ? placeAt(belt.angle + Math.PI / 2) : null;
  const device = deviceOf(mark);
  view.labels.add(device, short(mark.name) + note, camera.toX(x), camera.toY(y), { importance: view.device === device ? CHOSEN : importance, reach: Math.min(reach, 80) + beyond, colour, bold: importance > 5, towards });
}

export function drawLines(context, camera, colours, view) {
  for (const mark of view.recording.head.marks) {
    const device = deviceOf(mark);
    if (mark.look === "beam") drawEye(context, camera, colours, view, mark, device);
    else if (mark.look === "passage" || mark.look === "check") drawPassage(context, camera, colours, view, mark, device);
    else if (mark.look === "entry") drawEntry(context, camera, colours, view, mark, device);
  }
}

function drawEye(context, camera, colours, view, mark, device) {
  const blocked = view.signal(`${device}/blocked`) === 1;
  const colour = blocked ? colours.lit : colours.eye;
  outline(context, camera, mark.points, false);
  if (blocked) {
    context.globalAlpha = 0.25;
    context.lineWidth = 9;
    context.strokeStyle = colour;
    context.stroke();
    context.globalAlpha = 1;
  }
  context.setLineDash(blocked ? [] : [5, 4]);
  context.lineWidth = blocked ? 3 : 1.5;
  context.strokeStyle = colour;
  context.stroke();
  context.setLineDash([]);
  const size = blocked ? 9 : 7;
  for (const [x, y] of mark.points) {
    view.labels.keepOff(camera.toX(x), camera.toY(y), size / 2 + 1);
    context.fillStyle = blocked ? colour : colours.paper;
    context.lineWidth = 2;
    context.fillRect(camera.toX(x) - size / 2, camera.toY(y) - size / 2, size, size);
    context.strokeRect(camera.toX(x) - size / 2, camera.toY(y) - size / 2, size, size);
  }
  label(view, camera, mark, blocked ? " ■" : "", 4, colour, size / 2);
}

function drawPassage(context, camera, colours, view, mark, device) {
  const since = view.clock.time - view.signal(`${device}/bad_time`);
  const bad = view.signal(`${device}/bad`) > 0 && since >= 0 && since < SHOWN_BAD;
  outline(context, camera, mark.points, false);
  context.lineWidth = bad ? 4 : 2;
  context.strokeStyle = bad ? colours.lit : colours.passage;
  context.stroke();
  const passed = view.signal(`${device}/forward`) ?? view.signal(`${device}/count`);
  label(view, camera, mark, passed === undefined ? "" : ` ${passed}`, 2, colours.passage);
}

function drawEntry(context, camera, colours, view, mark, device) {
  const now = doing(view, device), colour = now ? now.colour : colours.entry;
  const [x, y] = mark.points[0], size = Math.max(9, Math.min(18, 0.06 * camera.scale));
  const at = (along, across) => {
    const cos = Math.cos(mark.direction), sin = Math.sin(mark.direction);
    return [camera.toX(x) + along * cos - across * sin, camera.toY(y) - along * sin - across * cos];
  };
  context.beginPath();
  context.moveTo(...at(0, 0));
  context.lineTo(...at(-1.1 * size, 0.6 * size));
  context.lineTo(...at(-1.1 * size, -0.6 * size));
  context.closePath();
  context.fillStyle = colour;
  context.fill();
  context.lineWidth = 1;
  context.strokeStyle = colours.halo;
  context.stroke();
  const isStation = mark.kind === "station"; // its region shows its name and state
  if (isStation) return;
  const name = now ? now.name : "";
  if (!hasNeighbour(view.recording.head, mark)) label(view, camera, mark, name, 6, colours.ink);
  else { // a name at the edge of the belt would stand beside another entry
    const [bx, by] = at(-0.55 * size, 0), towards = outside(mark.direction + Math.PI);
    view.labels.add(device, short(mark.name) + name, bx, by, { importance: view.device === device ? CHOSEN : 6, reach: 0.55 * size, colour: colours.ink, bold: true, towards });
  }
}

// Returns the ends of a moving rail.
export function moverEnds(mover, position) {
  const [px, py] = mover.pivot ?? mover.from; // recordings of earlier versions have no pivot
  const cos = Math.cos(mover.turning * position), sin = Math.sin(mover.turning * position);
  return [mover.from, mover.to].map(([x, y]) => [
    px + mover.along[0] * position + (x - px) * cos - (y - py) * sin,
    py + mover.along[1] * position + (x - px) * sin + (y - py) * cos,
  ]);
}

// Returns the value of a cam at a coordinate.
function camAt(parts, at) {
  const [u, s, slope, curvature] = parts.findLast(([start]) => start <= at) ?? parts[0];
  return s + (slope + 0.5 * curvature * (at - u)) * (at - u);
}

// Returns the outline of a star wheel, a pocket of a screw or a side belt at an angle of its machine; null if it is absent.
export function bodyPoints(body, angle) {
  let at = angle - body.lag, aside = [0, 0];
  if (body.period) at -= body.period * Math.floor(at / body.period);
  if (body.cam) {
    if (at < body.cam.parts[0][0] || at > body.cam.end) return null;
    if (body.slide) aside = body.slide.direction.map((part) => part * camAt(body.slide.parts, at));
    at = camAt(body.cam.parts, at);
  }
  const cos = Math.cos(body.turning * at), sin = Math.sin(body.turning * at), [px, py] = body.pivot;
  const [sx, sy] = [body.along[0] * at + aside[0], body.along[1] * at + aside[1]];
  return body.outline.map(([x, y]) => [px + sx + (x - px) * cos - (y - py) * sin, py + sy + (x - px) * sin + (y - py) * cos]);
}

// Returns the bodies that are present, each with its name and its points.
export function bodiesNow(view) {
  return view.recording.head.bodies
    .map((body) => ({ device: body.name, points: bodyPoints(body, view.signal(`${body.name}/angle`) ?? 0) }))
    .filter(({ points }) => points);
}

export function drawBodies(context, camera, colours, view) {
  const named = new Set();
  for (const { device, points } of bodiesNow(view)) {
    outline(context, camera, points, false);
    context.lineWidth = Math.max(2, 0.006 * camera.scale);
    context.strokeStyle = colours.mover;
    context.stroke();
    if (named.has(device)) continue;
    named.add(device);
    const [x, y] = middle(points);
    view.labels.add(device, short(device.split("/")[1]), camera.toX(x), camera.toY(y), { importance: view.device === device ? CHOSEN : 4, reach: 6, colour: colours.mover });
  }
}

export function drawMovers(context, camera, colours, view) {
  const devices = new Map(); // points of the rails of each device, and the direction of its motion
  for (const mover of view.recording.head.movers) {
    const share = view.signal(`${mover.name}/position`);
    const position = share === undefined ? mover.first : share * mover.stroke;
    const isPresent = position <= (mover.present ?? 1) * mover.stroke; // a lifted gate touches nothing
    const drawn = [[0, 1, 0.5], [mover.stroke, 1, 0.5], ...(isPresent ? [[position, Math.max(4, 0.014 * camera.scale), 1]] : [])];
    for (const [at, width, alpha] of drawn) {
      outline(context, camera, moverEnds(mover, at), false);
      context.globalAlpha = alpha;
      context.setLineDash(alpha < 1 ? [3, 4] : []);
      context.lineCap = "round";
      context.lineWidth = width;
      context.strokeStyle = colours.mover;
      context.stroke();
    }
    context.setLineDash([]);
    context.lineCap = "butt";
    const slides = mover.along[0] || mover.along[1];
    const points = [position, ...(slides ? [0, mover.stroke] : [])].flatMap((at) => moverEnds(mover, at));
    devices.set(mover.name, { along: mover.along, points: [...(devices.get(mover.name)?.points ?? []), ...points] });
  }
  for (const [device, { along: [ax, ay], points }] of devices) nameMover(camera, colours, view, device, ax, ay, points);
}

// Names a device beside all of its rails; one that slides beyond its way, in the direction (ax, ay) of its motion.
function nameMover(camera, colours, view, device, ax, ay, points) {
  const [[left, right], [low, high]] = [0, 1].map((axis) => points.map((point) => point[axis])).map((values) => [Math.min(...values), Math.max(...values)]);
  const [width, height] = [right - left, high - low], slides = ax || ay;
  const reach = 4 + 0.5 * camera.scale * (slides ? Math.abs(ax) * width + Math.abs(ay) * height : Math.max(width, height));
  const importance = view.device === device ? CHOSEN : 4, towards = slides ? outside(Math.atan2(ay, ax)) : null;
  view.labels.add(device, short(device.split("/")[1]), camera.toX((left + right) / 2), camera.toY((low + high) / 2), { importance, reach, colour: colours.mover, towards });
}
