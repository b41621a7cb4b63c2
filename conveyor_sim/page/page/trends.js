// SPDX-License-Identifier: Apache-2.0
// Trends of chosen signals around now, with commands and faults as marks; drawn by uPlot. Switches have a lane each, below.

import { COLOURED, palette } from "./colours.js";
import { byId, element, seconds, short, shown } from "./dom.js";
import { SignalInput } from "./signal_input.js";

const MOST = 8; // signals
const MARKS = { alarm: "#d55e00", fault: "#cc79a7", refused: "#e69f00", failed: "#d1330d", difference: "#8250df" };
const LONGEST = 28; // longest text of a mark
const WINDOWS = [10, 30, 60, 120]; // s
const GUTTER = 76, MARGIN = 6; // px beside the trends, and on both sides of a name there
const LANE = 1.5; // height of a switch's lane, whose values are 0 and 1
const LANES_SHARE = 0.17, LANES_MOST = 0.65; // share of the height: one lane, and all lanes at most

export class Trends {
  constructor(view) {
    this.view = view;
    this.names = [];
    this.window = this._firstWindow();
    this.plot = null;
    this.field = new SignalInput("Add a signal to the trends", () => this.view.series.names(), (name) => {
      this.add(name);
      return "";
    });
    this.chips = element("div", { class: "chips" });
    this.choice = element("select", { "aria-label": "Seconds shown", onchange: () => { this.window = +this.choice.value; view.touch(); } },
      ...WINDOWS.map((window) => element("option", { value: window, selected: window === this.window }, `${window} s`)));
    byId("trendbar").append(this.chips, this.field.input,
      element("datalist", { id: "signals" }, ...view.series.names().map((name) => element("option", { value: name }))), this.choice, this.field.refusal);
    if (view.rival) byId("trendbar").append(element("small", {}, "dashed: B"));
    this.box = byId("trends");
    for (const name of this._first()) this.add(name);
  }

  // Chooses the signals shown at first: those that a test has read; else machines and photo-eyes before belts.
  _first() {
    const { signals, trends } = this.view.recording.head, found = [];
    if (trends?.length) return trends.slice(0, MOST);
    for (const pattern of [/^belts\/.*\/speed$/, /^photo_eyes\/.*\/blocked$/, /^zones\/.*\/bottles$/, /^gates\/.*\/position$/, /\/rate$/]) {
      found.push(...signals.filter((name) => pattern.test(name)).slice(0, 2));
    }
    return found.slice(0, 4);
  }

  // Returns the shortest window that shows the last action of a failed test when the page opens, s.
  _firstWindow() {
    const { action, time } = this.view.recording.head.failures?.at(-1) ?? {};
    return WINDOWS.find((window) => window >= 30 && (!action || time - action.time < 0.7 * window)) ?? WINDOWS[WINDOWS.length - 1];
  }

  add(name) {
    if (this.names.includes(name) || !this.view.series.has(name)) return;
    this.names = [...this.names, name].slice(-MOST);
    this._chipped();
  }

  // Shows these signals alone. window: s.
  show(names, window) {
    this.names = names.slice(-MOST);
    if (WINDOWS.includes(window)) this.choice.value = this.window = window;
    this._chipped();
  }

  remove(name) {
    this.names = this.names.filter((other) => other !== name);
    this._chipped();
    this.field.input.focus(); // the focused element was removed
  }

  _chipped() {
    this.said = new Map(this.names.map((name) => [name, element("span", { class: "said" })]));
    this.chips.replaceChildren(...this.names.map((name, i) => {
      const swatch = element("span", { class: "swatch" });
      swatch.style.background = COLOURED(i);
      return element("button", { class: "chip", title: `Remove ${name}`, "aria-label": `Remove ${name} from the trends`, onclick: () => this.remove(name) }, swatch, `${name} `, element("b", { class: this._scale(name) === "switch" ? "switch" : "" }), this.said.get(name), " ✕");
    }));
    this.plot?.destroy();
    this.plot = null;
    this.view.touch();
  }

  // Returns the scale of a signal: switches in lanes, all others of one unit on one axis.
  _scale(name) {
    const tag = this.view.series.tag(name);
    return tag?.kind === "bool" ? "switch" : tag?.unit || "1";
  }

  // Returns the lane of a switch, counted from above.
  _lane(name) {
    return this.switches.length - 1 - this.switches.indexOf(name);
  }

  // Returns the share of the height for lanes: all of it if there are only switches.
  _lanesShare() {
    const { length } = this.switches;
    return length === this.names.length ? 1 : Math.min(LANES_MOST, LANES_SHARE * length);
  }

  _make() {
    this.switches = this.names.filter((name) => this._scale(name) === "switch");
    this.lowest = new Map(); // by scale, the value just above the lanes
    const colours = palette(), scales = { x: { time: false } }, axes = [{ stroke: colours.muted, size: 28, gap: 2, grid: { stroke: colours.slat, width: 1 }, values: (_, at) => at.map((time) => `${time} s`) }];
    for (const scale of new Set(this.names.map((name) => this._scale(name)))) {
      scales[scale] = { auto: false };
      const written = (value) => (value < this.lowest.get(scale) ? "" : scale === "1" ? `${value}` : `${value} ${scale}`); // not beside the lanes
      if (scale !== "switch" && axes.length < 3) axes.push({ scale, stroke: colours.muted, size: GUTTER, space: 16, side: axes.length === 1 ? 3 : 1, grid: { show: axes.length === 1, stroke: colours.slat, width: 1 }, values: (_, at) => at.map((value) => written(+value.toPrecision(9))) });
    }
    if (axes.length === 1) axes.push({ scale: "switch", stroke: colours.muted, size: GUTTER, grid: { show: false }, ticks: { show: false }, values: (_, at) => at.map(() => "") });
    const stepped = uPlot.paths.stepped({ align: 1 });
    this.plot = new uPlot({
      width: this.box.clientWidth, height: this.box.clientHeight, legend: { show: false }, scales, axes, cursor: { y: false, drag: { x: false, y: false } },
      series: [{}, ...this._drawn().map(({ name, i, dash }) => ({ label: name, scale: this._scale(name), stroke: COLOURED(i), width: 2, dash, points: { show: false }, spanGaps: dash !== null, paths: this._steps(name) ? stepped : undefined }))],
      hooks: { draw: [(plot) => this._lanes(plot), (plot) => this._marks(plot)] },
    }, this._data(), this.box);
    this.plot.over.addEventListener("click", (event) => this.view.jump(this.plot.posToVal(event.offsetX, "x")));
    this.theme = colours;
  }

  // Returns true for a signal that changes in steps, as all commands do.
  _steps(name) {
    const { series, recording } = this.view;
    return series.tag(name)?.kind !== "number" || !recording.signalIndex.has(name);
  }

  // One line per signal, and a dashed one for its value in the other recording.
  _drawn() {
    const lines = this.names.map((name, i) => ({ name, i, of: this.view.series, dash: null })), { rival } = this.view;
    return rival ? [...lines, ...lines.map((line) => ({ ...line, of: rival.series, dash: [5, 4] }))] : lines;
  }

  _span() {
    const { clock, clock: { recording } } = this.view, from = Math.max(recording.start, clock.time - 0.75 * this.window);
    return [from, Math.min(Math.max(recording.end, from + 1), from + this.window)];
  }

  _data() {
    const [from, to] = this._span(), all = this._drawn().map(({ name, of }) => this._laned(name, of.between(name, from, to)));
    if (this.view.rival || this.names.some((name) => !this.view.recording.signalIndex.has(name))) return uPlot.join(all.map(({ times, values }) => [times, values]));
    return [all[0]?.times ?? [], ...all.map(({ values }) => values)];
  }

  _laned(name, { times, values }) {
    return { times, values: this.switches.includes(name) ? values.map((value) => value + LANE * this._lane(name)) : values };
  }

  // Returns a name, shortened to a width in px of the canvas.
  _fitting(context, name, width) {
    let text = name;
    for (let letters = name.length; letters > 1 && context.measureText(text).width > width; letters -= 1) text = short(name, letters);
    return text;
  }

  // Names beside the lanes, because colours alone are not accessible.
  _lanes(plot) {
    const { ctx: context, bbox } = plot, margin = MARGIN * devicePixelRatio;
    context.save();
    context.fillStyle = palette().muted;
    context.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (const name of this.switches) {
      const text = this._fitting(context, name.startsWith("alarms/") ? name.slice(7).split("/").slice(-2).join("/") : name.split("/").slice(-2)[0], bbox.left - 2 * margin);
      context.fillText(text, bbox.left - margin, plot.valToPos(LANE * this._lane(name) + 0.5, "switch", true));
    }
    context.restore();
  }

  _marks(plot) {
    const { ctx: context, bbox } = plot, { clock, story } = this.view, [from, to] = this._span(), colours = palette();
    let free = 0; // px from which there is room for a text
    const line = (time, colour, dash) => {
      const x = plot.valToPos(time, "x", true);
      context.strokeStyle = colour;
      context.lineWidth = devicePixelRatio;
      context.setLineDash(dash);
      context.beginPath();
      context.moveTo(x, bbox.top);
      context.lineTo(x, bbox.top + bbox.height);
      context.stroke();
      context.setLineDash([]);
    };
    const say = (time, text) => {
      const x = plot.valToPos(time, "x", true);
      if (x < free) return;
      context.fillStyle = colours.ink;
      context.strokeStyle = colours.halo;
      context.lineWidth = 4 * devicePixelRatio;
      context.lineJoin = "round";
      context.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
      const long = context.measureText(text).width, fits = x + 3 + long < bbox.left + bbox.width;
      if (!fits && x - 3 - long < free) return;
      context.textAlign = fits ? "left" : "right";
      for (const write of ["strokeText", "fillText"]) context[write](text, fits ? x + 3 : x - 3, bbox.top + 12 * devicePixelRatio);
      free = fits ? x + 8 + long : x;
    };
    context.save();
    const { recording } = this.view;
    // Values that a controller displays on the panel change all the time, and would hide the other marks.
    const shown = (place) => /^panel\/.*\/write$/.test(recording.head.commands[place]);
    const given = story.data.readback.filter(([, place, , writer]) => writer !== "scene" && !shown(place));
    const short = (value) => (Number.isInteger(value) ? value : +value.toPrecision(4));
    const marks = [
      ...given.map(([time, place, value]) => ({ time, kind: "command", text: `${recording.head.commands[place].split("/").slice(-2).join("/")} = ${short(value)}` })),
      ...story.marks,
    ].filter(({ time }) => time >= from && time <= to).sort((one, other) => one.time - other.time);
    for (const { time, kind } of marks) line(time, MARKS[kind] ?? colours.muted, kind === "command" ? [3, 3] : [6, 3]);
    line(clock.time, colours.ink, []);
    for (const failure of recording.head.failures ?? []) this._sinceAction(plot, failure);
    for (const { time, text } of marks) say(time, text.length > LONGEST ? `${text.slice(0, LONGEST)}…` : text);
    context.restore();
  }

  // Draws the time from the last action of a test to the failure.
  _sinceAction(plot, { time, action }) {
    if (!action || action.time >= time) return;
    const { ctx: context, bbox } = plot, colours = palette(), ratio = devicePixelRatio, y = bbox.top + 24 * ratio, tip = 5 * ratio;
    const inside = (at) => Math.min(bbox.left + bbox.width, Math.max(bbox.left, plot.valToPos(at, "x", true))), from = inside(action.time), to = inside(time);
    if (to - from < 1) return;
    context.strokeStyle = context.fillStyle = MARKS.failed;
    context.lineWidth = 1.5 * ratio;
    context.beginPath();
    for (const [x, inwards] of [[from, tip], [to, -tip]]) {
      context.moveTo(x + inwards, y - tip);
      context.lineTo(x, y);
      context.lineTo(x + inwards, y + tip);
    }
    context.moveTo(from, y);
    context.lineTo(to, y);
    context.stroke();
    const text = seconds(time - action.time);
    context.font = `600 ${11 * ratio}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    const half = context.measureText(text).width / 2 + 3 * ratio, middle = Math.min(bbox.left + bbox.width - half, Math.max(bbox.left + half, (from + to) / 2));
    context.fillStyle = colours.halo;
    context.fillRect(middle - half, y - 8 * ratio, 2 * half, 16 * ratio);
    context.fillStyle = colours.ink;
    context.fillText(text, middle, y);
    context.textBaseline = "alphabetic";
  }

  draw() {
    if (!this.box.clientHeight || !this.names.length) return;
    if (!this.plot || this.theme !== palette()) {
      this.plot?.destroy();
      this._make();
    }
    const forced = this.view.story.forcedAt(this.view.clock.time);
    for (const [name, said] of this.said) said.textContent = forced.has(name) ? ", forced" : "";
    const { clientWidth: width, clientHeight: height } = this.box;
    if (this.plot.width !== width || this.plot.height !== height) this.plot.setSize({ width, height });
    this._written();
    this.plot.setData(this._data(), false);
    const [min, max] = this._span();
    this.plot.batch(() => {
      for (const scale of Object.keys(this.plot.scales)) if (scale !== "x") this.plot.setScale(scale, this._range(scale));
      this.plot.setScale("x", { min, max });
    });
    const now = this.names.map((name, i) => `${name} ${this.chips.children[i].querySelector("b").textContent}`);
    this.box.setAttribute("aria-label", `Trends up to ${seconds(this.view.clock.time)}: ${now.join(", ")}`);
  }

  // Writes the present value of each signal on its chip.
  _written() {
    this.names.forEach((name, i) => {
      const tag = this.view.series.tag(name), value = this.chips.children[i].querySelector("b");
      const text = [...new Set(this.view.plans.map(({ view }) => shown(view.series.value(name), tag)))].join(" | "); // of A and B
      if (value.textContent !== text) value.textContent = text;
    });
  }

  _range(scale) {
    const lanes = this._lanesShare();
    if (scale === "switch") return { min: -0.2, max: (LANE * this.switches.length) / lanes };
    const values = this._drawn().flatMap(({ name }, i) => (this._scale(name) === scale ? Array.from(this.plot.data[i + 1]).filter(Number.isFinite) : []));
    const low = values.reduce((least, value) => Math.min(least, value), Infinity), high = values.reduce((most, value) => Math.max(most, value), -Infinity);
    if (!(low <= high)) return { min: 0, max: 1 };
    const room = low === high ? Math.max(0.5, 0.1 * Math.abs(low)) : 0.08 * (high - low);
    const least = low - room, most = high + room;
    this.lowest.set(scale, low - 0.6 * room);
    return { min: least - (lanes / (1 - lanes)) * (most - least), max: most };
  }
}
