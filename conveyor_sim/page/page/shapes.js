// SPDX-License-Identifier: Apache-2.0
// Points and polygons of the plan, m.

// Returns the least x and y, and the greatest, of all drawn parts of recordings.
export function boundsOf(recordings) {
  const points = recordings.filter(Boolean).flatMap(({ head }) => [...head.surfaces.flatMap(({ outline }) => outline), ...head.rails.flat(), ...head.marks.flatMap(({ points: all }) => all)]);
  const [xs, ys] = [0, 1].map((k) => points.map((point) => point[k]));
  const least = (list) => list.reduce((a, b) => Math.min(a, b), Infinity), most = (list) => list.reduce((a, b) => Math.max(a, b), -Infinity);
  return points.length ? [least(xs), least(ys), most(xs), most(ys)] : [-1, -1, 1, 1];
}

// Returns true if a point lies in a polygon.
export function inside(points, x, y) {
  let found = false;
  points.forEach(([ax, ay], k) => {
    const [bx, by] = points[(k + 1) % points.length];
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) found = !found;
  });
  return found;
}

// Returns the area of a polygon, m²; negative if its points run clockwise.
export const signedArea = (points) => points.reduce((sum, [x, y], k) => sum + x * (points[(k + 1) % points.length][1] - points.at(k - 1)[1]), 0) / 2;

// Returns the distance of a point from the segment between two others.
export function awayFrom([ax, ay], [bx, by], x, y) {
  const length = (bx - ax) ** 2 + (by - ay) ** 2;
  const share = length ? Math.min(1, Math.max(0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length)) : 0;
  return Math.hypot(ax + share * (bx - ax) - x, ay + share * (by - ay) - y);
}

