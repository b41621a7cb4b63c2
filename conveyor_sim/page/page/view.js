// SPDX-License-Identifier: Apache-2.0
// The view: displayed state of a line, selection, and the parts that draw it.

import { Alarms } from "./alarms.js";
import { Banner } from "./banner.js";
import { Bars } from "./bars.js";
import { Beside } from "./beside.js";
import { Bottle } from "./bottle.js";
import { Camera } from "./camera.js";
import { Clock } from "./clock.js";
import { COLOURINGS, SCALES, colourings, isDark } from "./colours.js";
import { Compare } from "./compare.js";
import { Desk } from "./desk.js";
import { deviceOf } from "./devices.js";
import { byId, element, expire, keyOf, say, seconds, warn } from "./dom.js";
import { Events } from "./events.js";
import { Failure } from "./failure.js";
import { Faceplate } from "./faceplate.js";
import { HEATS, Heat, heatColours } from "./heat.js";
import { Kpi } from "./kpi.js";
import { Link } from "./link.js";
import { LiveClock } from "./live_clock.js";
import { Minimap } from "./minimap.js";
import { OperatorPanel } from "./operator.js";
import { Plan } from "./plan.js";
import { Scrubber } from "./scrubber.js";
import { boxOf, deviceAt, outlinesOf } from "./selection.js";
import { Series } from "./series.js";
import { boundsOf } from "./shapes.js";
import { Tabs } from "./tabs.js";
import { Tiles } from "./tiles.js";
import { Trends } from "./trends.js";
import { Watch } from "./watch.js";
import { NO_WEAR, WEARS, Wear } from "./wear.js";

const PLANT_SCALE = 5; // px, radius of the largest bottles below which a click selects devices rather than bottles
const MEASURED = 5000; // forces of a block from which the scale is made
const MOST_EVENTS = 5000; // events of a running line; beyond that, events before the visible time are dropped
const PANELS_EVERY = 120; // ms between two updates of the panels during playback

export class View {
  // other: a second recording that is shown beside the first, and its story; else null. line: of a running line, its
  // message "begin"; else null.
  constructor(recording, story, other, line = null, about = null) {
    Object.assign(this, { recording, story, line, bottle: null, device: null, following: false, colouring: "type", shownWear: "", shownHeat: "", shownSpan: "last", showForces: true, showNames: true, dirty: true });
    this.rival = null; // the other view
    this.letter = ""; // A, if two recordings are shown side by side
    this.fastest = 0.1;
    this.strongest = 1;
    this.touching = false; // true once contacts have been seen
    this.oldest = line ? 60 : Math.max(1, Math.min(60, recording.end - recording.start));
    this.clock = line ? new LiveClock(recording) : new Clock(recording, other?.recording);
    this.desk = line ? new Desk(this, about) : null;
    this.watch = line ? new Watch(this) : null;
    this.camera = new Camera(boundsOf([recording, other?.recording]));
    this.series = new Series(this);
    this.wear = new Wear(this);
    this.heat = new Heat(this);
    this.minimap = new Minimap(this);
    this.plan = new Plan(byId("plan"), this);
    this.plans = [this.plan];
    if (other) {
      this.beside = new Beside(this, other.recording, other.story, recording.head.compared.names);
      this.compare = new Compare(this, recording.head.compared);
      this.plans.push(this.beside.plan);
    }
    this.banner = new Banner(this);
    this.kpi = new Kpi(this);
    this.operator = new OperatorPanel(this);
    this.scrubber = new Scrubber(this);
    this.trends = new Trends(this);
    this.faceplate = new Faceplate(this);
    const shown = this.plans.map(({ view }) => view);
    this.alarms = shown.map((one) => new Alarms(one));
    this.bars = shown.map((one) => new Bars(one));
    this.events = new Events(this);
    const production = { title: "Line", parts: [...this.bars, ...shown.map((one) => new Tiles(one))] };
    const panels = { line: production, alarms: { title: "Alarms", parts: this.alarms }, events: { title: "Events", parts: [this.events] },
      device: { title: "Device", parts: [this.faceplate] }, ...(line ? { watch: { title: "Watch", parts: [this.watch] } } : {}), bottle: { title: "Bottle", parts: [new Bottle(this)] } };
    const first = { ...(other ? { compare: { title: "A, B", parts: [this.compare] } } : {}),
      ...(recording.head.failures?.length ? { failure: { title: "Failure", parts: [new Failure(this)] } } : {}) };
    this.tabs = new Tabs({ ...first, ...panels }, Object.keys(first)[0] ?? (this.bars[0].names.length ? "line" : "device"));
    for (const part of [this.clock, this.camera]) part.addEventListener("change", () => this.touch());
    for (const one of this.clock.all) {
      one.addEventListener("loaded", () => this._loaded());
      one.addEventListener("failed", (event) => warn(event.detail));
    }
    this.link = new Link(this);
    this.snapping = null;
  }

  touch() {
    this.dirty = true;
  }

  badge(name, count) {
    this.tabs?.badge(name, count);
  }

  signal(name) {
    return this.recording.signal(name, this.clock.time);
  }

  toldMore(part) {
    this.toldMoreOf(this.story, part);
  }

  // Does the same for the other recording.
  toldMoreOf(story, part) {
    story.add(part);
    this.events.filter();
    for (const bars of this.bars) bars.named();
    this.worn();
    this.touch();
  }

  // Adds frames and events of a running line.
  receive() {
    const { line, recording, story } = this;
    line.addEventListener("frame", ({ detail }) => {
      recording.append(detail);
      this.measure(detail.block);
      this.touch();
    });
    line.addEventListener("story", ({ detail }) => {
      if (story.events.length > MOST_EVENTS) story.forget(recording.start);
      this.toldMore(detail);
      this.desk.happened(detail.events);
    });
    line.addEventListener("begin", ({ detail }) => {
      if (still(detail.head) !== still(recording.head)) location.reload();
      recording.begin(detail.head);
      story.begin(detail.head);
      this.toldMore(detail.story);
      this.desk.status = detail.status;
      this.desk.connection();
      if (this.clock.live) this.clock.follow();
      else this.clock.seek(this.clock.time);
    });
  }

  // Shows the choice of heat maps if the recording has any.
  worn() {
    byId("worn").hidden = !this.story.data.wear.length;
  }

  _loaded() {
    if (this.snapping) this.snap(this.snapping.from);
    this._measure();
    this.touch();
  }

  // Scales only grow, so that a colour means the same in all frames.
  _measure() {
    for (const block of this.clock.all.flatMap(({ blocks }) => [...blocks.values()])) {
      if (!block.measured) this.measure(block);
    }
  }

  measure(block) {
    block.measured = true;
    for (const { belt, ratio } of this.recording.head.surfaces) {
      for (const value of block.belts.columns[belt]?.values ?? []) this.fastest = Math.max(this.fastest, ratio * Math.abs(value));
    }
    const every = Math.ceil(block.contacts.reduce((sum, { force }) => sum + force.length, 0) / MEASURED);
    const forces = block.contacts.flatMap(({ force }) => Array.from(force).filter((_, i) => i % every === 0)).sort((a, b) => a - b);
    this.strongest = Math.max(this.strongest, forces[Math.floor(0.99 * forces.length)] ?? 0);
    this.touching ||= forces.length > 0;
  }

  // Holds the time at a frame of the recording, once it is loaded. from: at the first one from the time on.
  snap(from = false) {
    if (this.clock.playing) return;
    const time = this.clock.recording.frameTime(this.clock.time, from);
    this.snapping = time === null ? { from } : null;
    if (time !== null && this.clock.time !== time) this.clock.seek(time);
  }

  // Returns the distance of a bottle from its position in the other recording, m; infinite if it is not there.
  apart(bottle) {
    const { frame } = this.rival.plan;
    if (!frame) return 0;
    frame.byId ??= new Map(frame.bottles.map((other) => [other.id, other]));
    const other = frame.byId.get(bottle.id);
    return other ? Math.hypot(bottle.x - other.x, bottle.y - other.y) : Infinity;
  }

  // Shows the result of the comparison as a notice and as marks.
  compared() {
    this.story.differences = this.compare.marks();
    this.story.build();
    say(this.compare.words());
    this.touch();
  }

  // Jumps to a time, at whose end its events have happened, and to the place of a tag or a bottle.
  jump(time, tag = "", bottle = -1) {
    const { start } = this.clock.recording;
    this.clock.pause();
    this.clock.seek(time);
    if (!this.line) this.snap(true);
    if (time < start - 1e-6) say(`${seconds(time)} is before the shown part, which begins at ${seconds(start)}.`);
    if (bottle >= 0) this.selectBottle(bottle, false);
    const { bodies, marks, movers, surfaces } = this.recording.head;
    const devices = [...marks.map(deviceOf), ...[...movers, ...bodies].map(({ name }) => name), ...surfaces.map(({ name }) => `belts/${name}`)];
    const device = devices.find((name) => tag && (tag === name || tag.startsWith(`${name}/`)));
    if (device) this.selectDevice(device);
  }

  nextMark(by) {
    const marks = this.story.marks.filter(({ time }) => time >= this.recording.start), { time } = this.clock;
    const found = by > 0 ? marks.find((mark) => mark.time > time + 1e-3) : marks.reverse().find((mark) => mark.time < time - 1e-3);
    if (found) {
      this.jump(found.time);
      say(found.text, found.kind === "failed");
    }
  }

  selectBottle(id, show = true) {
    this.bottle = id;
    if (show) this.tabs.show("bottle");
    byId("said").textContent = id === null ? "" : `bottle ${id} chosen`;
    this.touch();
  }

  nextBottle(by) {
    const ids = (this.plan.frame?.bottles ?? []).map(({ id }) => id), place = ids.indexOf(this.bottle);
    if (ids.length) this.selectBottle(ids[(place < 0 ? (by > 0 ? 0 : ids.length - 1) : place + by + ids.length) % ids.length]);
  }

  // Shows the faceplate of a device and its outline on the plan, moved to it if needed.
  selectDevice(name) {
    this.device = name;
    this.faceplate.show(name);
    const box = boxOf(outlinesOf(this, name));
    if (box) {
      this.setFollowing(false);
      this.camera.show((box[0] + box[2]) / 2, (box[1] + box[3]) / 2);
    }
    byId("said").textContent = `${name} selected`;
    this.touch();
  }

  // Zooms to the selected device, else to the selected bottle.
  zoomToSelection() {
    const box = boxOf(this.device ? outlinesOf(this, this.device) : this._bottleOutline());
    if (!box) {
      say("Select a device or a bottle first.");
      return;
    }
    this.setFollowing(false);
    this.camera.showBox(box);
  }

  // Returns the place of the selected bottle as a list of outlines.
  _bottleOutline() {
    const bottle = this.plan.frame?.bottles.find(({ id }) => id === this.bottle);
    return bottle ? [[[bottle.x, bottle.y]]] : [];
  }

  setFollowing(on) {
    this.following = on && this.bottle !== null;
    this.touch();
  }

  letGo() {
    this.setFollowing(false);
    this.device = null;
    this.selectBottle(null, false);
  }

  wholePlant() {
    this.setFollowing(false);
    this.camera.fit();
  }

  setColouring(name) {
    this.colouring = byId("colour").value = name;
    this.touch();
  }

  // name: of HEATS; "" for none.
  setHeat(name) {
    this.shownHeat = byId("heat").value = name;
    byId("span").hidden = !name;
    this.touch();
  }

  nextHeat() {
    const names = Object.keys(HEATS);
    this.setHeat(names[(names.indexOf(this.shownHeat) + 1) % names.length]);
  }

  nextColouring() {
    const names = colourings(this);
    this.setColouring(names[(names.indexOf(this.colouring) + 1) % names.length]);
  }

  // Writes the legend of colours and lines, once their scales are known.
  _legend() {
    const colouring = COLOURINGS[this.colouring], entries = [], { shown, most } = this.wear, lines = this.showForces && this.touching, { heat } = this;
    const key = [heat.shown.of && heat.grid && [heat.shown.label, heat.extent, heat.most, isDark()], this.colouring, colouring.ends?.(this), shown, most, lines && this.strongest].join(" ");
    if (key === this.legendKey) return;
    this.legendKey = key;
    const ramp = (colours, low, high) => {
      const bar = element("span", { class: "ramp" });
      bar.style.background = `linear-gradient(to right, ${colours.join(", ")})`;
      return element("span", { class: "entry" }, `${low} `, bar, ` ${high}`);
    };
    if (!heat.shown.of) {
      if (colouring.ramp) entries.push(ramp(colouring.ramp, ...colouring.ends(this)));
      else entries.push(...keyOf(colouring.legend(this)));
    }
    if (shown && most > NO_WEAR) entries.push(ramp(SCALES.force, "rails 0", `${+most.toPrecision(2)} ${WEARS[shown].unit}`));
    else if (shown) entries.push(element("span", { class: "entry" }, `no ${shown} on rails`));
    if (heat.shown.of && heat.grid) {
      entries.push(element("span", { class: "entry heat" }, ramp(heatColours(), `${heat.shown.label} 0`, `≥ ${+heat.most.toPrecision(2)} ${heat.shown.unit}`), element("small", {}, heat.extent)));
    }
    if (lines) entries.push(element("span", { class: "entry" }, "contacts 0 ", element("span", { class: "wedge" }), ` ${+this.strongest.toPrecision(2)} N`));
    byId("legend").replaceChildren(...entries);
    this._coverEdges();
    this._cover();
  }

  // The legend and the buttons cover a part of the lower edge, and a failure covers a part of the upper one.
  _coverEdges() {
    const news = byId("news"), failed = news.className === "wrong" && this.plans.length === 1;
    this.camera.cover(Math.max(byId("legend").offsetHeight, byId("zoom").offsetHeight), failed ? news.offsetTop + news.offsetHeight : 0);
  }

  // Names on the plan move aside from what covers it.
  _cover() {
    for (const plan of this.plans) plan.cover();
    this.touch();
  }

  clicked(px, py, plan = this.plan) {
    const device = deviceAt(plan.view, ...this.camera.at(px, py)), { types } = plan.view.recording.head;
    const small = Math.max(...types.map(({ radius }) => radius)) * this.camera.scale < PLANT_SCALE;
    const bottle = small && device ? null : plan.bottleAt(px, py);
    if (bottle !== null) {
      this.selectBottle(bottle);
      return;
    }
    if (!device) return;
    this.selectDevice(device);
    this.tabs.show("device");
  }

  resize() {
    const { clientWidth, clientHeight } = byId("stage");
    this.minimap.resize(clientWidth, clientHeight);
    this._coverEdges();
    this.beside?.resize();
    this.plan.resize();
    this.touch();
  }

  draw(now) {
    if (this.plan.said !== byId("notice").textContent) this._coverEdges();
    for (const plan of this.plans) {
      plan.update();
      plan.view.heat.update(now);
    }
    this._follow();
    for (const plan of this.plans) plan.draw();
    this._legend();
    if (this.minimap.draw(this.device ? outlinesOf(this, this.device) : [])) this._cover();
    this.beside?.draw();
    this.scrubber.draw();
    const { clock, camera } = this, play = byId("play");
    byId("clock").textContent = seconds(clock.time);
    if (this.line) byId("end").textContent = seconds(this.recording.end);
    // The run of a line is paused above the plan; below it, only the display of the past is played.
    const [sign, text] = this.line ? (clock.playing ? ["■", "Stop the replay"] : ["▶", "Replay from here"]) : clock.playing ? ["❚❚", "Pause"] : ["▶", "Play"];
    play.textContent = sign;
    play.setAttribute("aria-label", text);
    if (this.line) play.title = `${text} (space)`;
    play.hidden = Boolean(clock.live);
    byId("speed").value = clock.speed;
    this.desk?.drawn(now);
    byId("plan").dataset.camera = [camera.x, camera.y, camera.scale, camera.width, camera.height].join(" ");
    byId("plan").dataset.frame = this.plan.frame ? this.plan.frame.time.toFixed(6) : "";
    document.body.dataset.bottles = this.plan.frame?.bottles.length ?? "";
    if (clock.playing && now - (this.panelsDrawn ?? 0) < PANELS_EVERY) return;
    this.panelsDrawn = now;
    expire();
    this.banner.draw();
    this.kpi.draw();
    this.operator.draw();
    for (const alarms of this.alarms) alarms.draw();
    this.tabs.draw();
    this.trends.draw();
  }

  _follow() {
    if (!this.following) return;
    const bottle = this.plan.frame?.bottles.find(({ id }) => id === this.bottle);
    if (bottle && (bottle.x !== this.camera.x || bottle.y !== this.camera.y)) this.camera.centre(bottle.x, bottle.y);
  }
}

// Returns the key of a line; a page continues only with a line of the same key.
const still = (head) => JSON.stringify({ ...head, run: "", seed: 0, times: null, forced: null });
