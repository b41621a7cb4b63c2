// SPDX-License-Identifier: Apache-2.0
// Colours, for light and dark: Okabe and Ito's palette, and scales that stay readable for the colour-blind.

export const SERIES = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"];
export const CATEGORIES = {
  running: "#009e73", starved: "#56b4e9", blocked: "#e69f00", down: "#d55e00", planned: "#cc79a7", idle: "#98a4b0",
};
const LIGHT = {
  paper: "#f6f8fa", belt: "#dde3e9", beltEdge: "#98a4b0", slat: "#c6ced6", chevron: "#5b6875", rail: "#111827", ink: "#1f2933",
  halo: "#ffffff", muted: "#616e7c", mover: "#a3447f", eye: "#0e5a8a", lit: "#d1330d", zone: "#4d5f0a", passage: "#5b21b6",
  entry: "#00735c", exit: "#a3447f", edge: "#243b53", select: "#d1330d", force: "#b3200a", line: "#0072b2",
};
const DARK = {
  paper: "#10161d", belt: "#26313c", beltEdge: "#4b5b6b", slat: "#33414f", chevron: "#8b9bab", rail: "#e4e9ee", ink: "#e4e9ee",
  halo: "#10161d", muted: "#93a1af", mover: "#e79fc6", eye: "#56b4e9", lit: "#ff6b3d", zone: "#b8c94a", passage: "#b79bff",
  entry: "#35c9a5", exit: "#e79fc6", edge: "#c9d3dc", select: "#ffb000", force: "#ff6b3d", line: "#56b4e9",
};

export function isDark() {
  const theme = document.documentElement.dataset.theme;
  return theme === "dark" || (theme === "auto" && matchMedia("(prefers-color-scheme: dark)").matches);
}

export const COLOURED = (place) => [...SERIES, "#8a8678", "#b79bff"][place % 8];
export const palette = () => (isDark() ? DARK : LIGHT);

// Cividis at equal steps: from blue to yellow, with increasing lightness.
const CIVIDIS = ["#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838"];
// From pale to strong, for forces.
const HEAT = ["#fff3c8", "#ffe08a", "#fdc04e", "#f99b2d", "#ee7420", "#db4d1a", "#b92c17", "#8f1614"];

export const STEPS = 16;
const hex = (colour) => [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));

function ramp(colours) {
  return Array.from({ length: STEPS }, (_, i) => {
    const at = (i / (STEPS - 1)) * (colours.length - 1), low = Math.min(colours.length - 2, Math.floor(at));
    const [a, b] = [hex(colours[low]), hex(colours[low + 1])];
    return `rgb(${a.map((part, k) => Math.round(part + (at - low) * (b[k] - part))).join(" ")})`;
  });
}

export const SCALES = { speed: ramp(CIVIDIS), force: ramp(HEAT), age: ramp([...CIVIDIS].reverse()) };

const FAR = 50; // mm between two recordings; larger distances have the same colour

export const colourings = (view) => Object.keys(COLOURINGS).filter((name) => name !== "apart" || view.rival);

// Colourings of bottles: a colour for each bottle, the crossed-out bottles, and the legend.
export const COLOURINGS = {
  type: {
    label: "by type",
    of: (bottle) => SERIES[bottle.type % SERIES.length],
    legend: (view) => view.recording.head.types.map((type, i) => [SERIES[i % SERIES.length], type.name]),
  },
  speed: scaled("by speed", "m/s", "speed", (bottle) => bottle.speed, (view) => view.fastest),
  force: scaled("by force", "N", "force", (bottle) => bottle.force, (view) => view.strongest),
  age: scaled("by age", "s", "age", (bottle, view) => view.clock.time - (view.story.fed.get(bottle.id) ?? view.recording.start), (view) => view.oldest),
  apart: scaled("by distance A to B", "mm", "force", (bottle, view) => 1000 * view.apart(bottle), () => FAR),
  defect: {
    label: "by defect",
    of: (bottle, view) => (view.story.rejected.has(bottle.id) ? SERIES[1] : SERIES[0]),
    crossed: (bottle, view) => view.story.rejected.has(bottle.id),
    legend: () => [[SERIES[0], "not rejected"], [SERIES[1], "✕ rejected, now or later"]],
  },
};

function scaled(label, unit, scale, value, most) {
  const colours = SCALES[scale];
  return {
    label,
    of: (bottle, view) => colours[Math.min(STEPS - 1, Math.max(0, Math.floor((value(bottle, view) / most(view)) * STEPS)))],
    ramp: colours,
    ends: (view) => ["0", `${+most(view).toPrecision(2)} ${unit}`],
  };
}
