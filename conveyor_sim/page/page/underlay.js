// SPDX-License-Identifier: Apache-2.0
// An image or a drawing below the plan.

const images = new Map(); // by data URL

// Returns an image once it is loaded; until then null, and loaded() is called later.
function imageOf(url, loaded) {
  const known = images.get(url);
  if (known) return known.complete && known.naturalWidth ? known : null;
  const image = new Image();
  images.set(url, image);
  image.addEventListener("load", () => {
    document.body.dataset.underlay = "shown";
    loaded();
  });
  image.src = url;
  return null;
}

// underlay: of the head; null without one. loaded(): draws again.
export function drawUnderlay(context, camera, colours, underlay, loaded) {
  if (!underlay) return;
  const [x, y] = underlay.position;
  context.save();
  context.globalAlpha = underlay.opacity;
  context.translate(camera.toX(x), camera.toY(y));
  context.rotate(-underlay.angle);
  const image = underlay.image ? imageOf(underlay.image, loaded) : null;
  if (image) {
    const width = image.naturalWidth * underlay.pixel * camera.scale, height = image.naturalHeight * underlay.pixel * camera.scale;
    context.drawImage(image, 0, -height, width, height);
  }
  context.beginPath();
  for (const line of underlay.lines) line.forEach(([px, py], k) => context[k ? "lineTo" : "moveTo"](px * camera.scale, -py * camera.scale));
  context.strokeStyle = colours.muted;
  context.lineWidth = 1;
  context.stroke();
  context.restore();
}
