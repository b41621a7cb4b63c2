// SPDX-License-Identifier: Apache-2.0
// Shapes of devices on the plan: for clicks, for the outline of the selected device, and to zoom to it.

import { bodiesNow, deviceOf, moverEnds } from "./devices.js";
import { awayFrom, inside, signedArea } from "./shapes.js";

const ROOM = 0.4; // m, least distance from the middle of a device to the edges of the window that shows it
const NEAR = 12, FINGER = 20; // px from a line or point within which a click, or a touch, selects its device

const beltOf = ({ name }) => `belts/${name}`;

// Returns the device of each mark and each moving rail at its present position, with its points, m.
function smallDevices(view) {
  const { head } = view.recording;
  const movers = head.movers.map((mover) => {
    const share = view.signal(`${mover.name}/position`);
    return { device: mover.name, points: moverEnds(mover, share === undefined ? mover.first : share * mover.stroke) };
  });
  return [...movers, ...bodiesNow(view), ...head.marks.map((mark) => ({ device: deviceOf(mark), points: mark.points }))];
}

// Returns the outlines of a device, each a list of points, m. A drive has those of its belts.
export function outlinesOf(view, device) {
  const { surfaces, drives } = view.recording.head;
  const belts = surfaces.filter((surface) => surface.name && [beltOf(surface), drives?.[beltOf(surface)]].includes(device));
  return [...smallDevices(view).filter((one) => one.device === device), ...belts.map(({ outline }) => ({ points: outline }))].map(({ points }) => points);
}

// Returns least x and y, and greatest, of outlines, with room around; null without outlines.
export function boxOf(outlines) {
  const points = outlines.flat();
  if (!points.length) return null;
  const [[x0, y0], [x1, y1]] = [Math.min, Math.max].map((end) => [0, 1].map((k) => end(...points.map((point) => point[k]))));
  const [x, y] = [(x0 + x1) / 2, (y0 + y1) / 2], [across, up] = [x1 - x, y1 - y].map((half) => Math.max(ROOM, 1.2 * half));
  return [x - across, y - up, x + across, y + up];
}

// Returns the device at a point, m: the smallest around it or the nearest; a belt where there is no other device; or null.
export function deviceAt(view, x, y) {
  const near = (matchMedia("(pointer: coarse)").matches ? FINGER : NEAR) / view.camera.scale;
  const found = smallDevices(view).map(({ device, points }) => {
    const far = Math.min(...points.map((point, k) => awayFrom(point, points[(k + 1) % points.length], x, y)));
    return { device, far: inside(points, x, y) ? 0 : far, area: Math.abs(signedArea(points)) };
  }).filter(({ far }) => far < near).sort((a, b) => a.area - b.area || a.far - b.far);
  const belt = view.recording.head.surfaces.findLast(({ name, outline }) => name && inside(outline, x, y));
  return found[0]?.device ?? (belt ? beltOf(belt) : null);
}

// Draws the outline of the selected device; small devices are drawn over it.
export function drawSelection(context, camera, colours, outlines) {
  for (const [more, colour] of [[4, colours.halo], [0, colours.select]]) {
    for (const points of outlines) {
      context.beginPath();
      if (points.length > 1) points.forEach(([x, y], k) => context[k ? "lineTo" : "moveTo"](camera.toX(x), camera.toY(y)));
      if (points.length > 2) context.closePath();
      if (points.length === 1) context.arc(camera.toX(points[0][0]), camera.toY(points[0][1]), 13, 0, 2 * Math.PI);
      context.lineJoin = context.lineCap = "round";
      context.lineWidth = more + (points.length === 2 ? 9 : 3);
      context.strokeStyle = colour;
      context.stroke();
    }
  }
  context.lineCap = "butt";
}
