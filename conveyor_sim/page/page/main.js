// SPDX-License-Identifier: Apache-2.0
// The page: opens a recording, two recordings, or a running line, and starts the drawing.

import { SPEEDS } from "./clock.js";
import { COLOURINGS, colourings, isDark } from "./colours.js";
import { byId, element, say, seconds, warn } from "./dom.js";
import { HEATS, LAST } from "./heat.js";
import { listenToKeys } from "./keys.js";
import { Layouts } from "./layouts.js";
import { Line } from "./live.js";
import { LiveRecording } from "./live_recording.js";
import { Recording } from "./recording.js";
import { openSource } from "./source.js";
import { Story } from "./story.js";
import { View } from "./view.js";
import { WEARS } from "./wear.js";

const BEFORE = 2; // s before the first difference at which a comparison opens

function wire(view) {
  const { clock, camera, recording } = view, { head } = recording;
  byId("scene").textContent = document.title = head.scene;
  byId("where").textContent = head.where || head.description || "";
  byId("end").textContent = seconds(clock.recording.end);
  byId("colour").append(...colourings(view).map((name) => element("option", { value: name }, COLOURINGS[name].label)));
  byId("colour").addEventListener("change", (event) => view.setColouring(event.target.value));
  byId("speed").append(...SPEEDS.map((speed) => element("option", { value: speed }, `${speed}×`)));
  byId("speed").addEventListener("change", (event) => clock.setSpeed(+event.target.value));
  const layouts = new Layouts(view);
  const clicks = {
    arrange: () => layouts.open(),
    play: () => clock.toggle(), back: () => clock.step(-1), ahead: () => clock.step(1), fit: () => view.wholePlant(),
    approach: () => view.zoomToSelection(), dismiss: () => say(""), closer: () => camera.zoom(1.5), farther: () => camera.zoom(1 / 1.5),
    to_start: () => { clock.seek(clock.recording.start); view.snap(); },
    theme: () => { document.documentElement.dataset.theme = isDark() ? "light" : "dark"; view.touch(); },
    toggle_trends: () => {
      const hidden = byId("drawer").toggleAttribute("hidden");
      byId("toggle_trends").setAttribute("aria-expanded", !hidden);
    },
    choices: () => byId("choices").setAttribute("aria-expanded", byId("display").toggleAttribute("data-open")),
  };
  for (const [id, action] of Object.entries(clicks)) byId(id).addEventListener("click", action);
  byId("wear").append(...Object.entries(WEARS).map(([name, { label }]) => element("option", { value: name }, label)));
  byId("wear").addEventListener("change", (event) => { view.shownWear = event.target.value; view.touch(); });
  byId("heat").append(...Object.entries(HEATS).map(([name, { label }]) => element("option", { value: name }, label)));
  byId("heat").addEventListener("change", (event) => view.setHeat(event.target.value));
  const whole = view.line ? "received data" : "whole recording";
  byId("span").append(...Object.entries({ last: `last ${LAST} s`, whole }).map(([name, label]) => element("option", { value: name }, label)));
  byId("span").addEventListener("change", (event) => { view.shownSpan = event.target.value; view.touch(); });
  view.worn();
  for (const [id, field] of [["forces", "showForces"], ["names", "showNames"]]) {
    byId(id).addEventListener("change", (event) => { view[field] = event.target.checked; view.touch(); });
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => view.touch());
  camera.listen(byId("plan"), (px, py) => view.clicked(px, py), () => view.setFollowing(false));
  listenToKeys(view);
  const narrow = matchMedia("(max-width: 600px)"); // there the plan needs the height of the trends
  const makeRoom = () => byId("drawer").hidden !== narrow.matches && byId("toggle_trends").click();
  narrow.addEventListener("change", makeRoom);
  makeRoom();
  new ResizeObserver(() => view.resize()).observe(byId("stage"));
  view.setColouring("type");
}

// Opens a recording and its story; the story of a long one is read later.
async function opened(source) {
  const head = await read(source, "head"), story = new Story(head);
  const failed = head.times.stories === 1 ? await told(source, 0, (part) => story.add(part)) : "";
  return { recording: new Recording(source, head), story, failed };
}

// Reads the story of a part of a recording. Returns the reason of a failure, or "".
async function told(source, part, take) {
  try {
    take(await read(source, `story/${part}`));
    return "";
  } catch (error) {
    return error.message;
  }
}

// Returns the tick with the most bottles; the first one if it can't be read.
async function fullest(source) {
  try {
    return await read(source, "fullest");
  } catch {
    return 0;
  }
}

async function read(source, name) {
  return JSON.parse(new TextDecoder().decode(await source.bytes(name)));
}

// Reads the largest forces of both recordings.
async function readPeaks(view, source, { stretches }) {
  for (let part = 0; part < stretches; part++) {
    try {
      view.compare.addPeaks(await read(source, `peaks/${part}`), (part + 1) / stretches);
    } catch (error) {
      warn(`The peak forces can't be read further: ${error.message}`);
      return;
    }
  }
  document.body.dataset.peaks = "yes";
}

// Compares both recordings until the first difference of each kind, then moves to just before the first of all.
async function compare(view, source, { stretches }) {
  const untouched = !view.clock.playing && view.clock.time === view.link.opened;
  for (let part = 0; part < stretches && !view.compare.complete; part++) {
    const before = view.compare.found.length;
    try {
      view.compare.add(await read(source, `difference/${part}`));
    } catch (error) {
      view.compare.failed = `The recordings can't be compared further: ${error.message}`;
      warn(view.compare.failed);
      return;
    }
    if (view.compare.found.length === before) continue;
    view.compared();
    for (const { signals } of view.compare.found) for (const name of signals.slice(0, 3)) view.trends.add(name);
    if (before || !untouched) continue;
    view.clock.seek(view.compare.found[0].time - BEFORE);
    view.snap();
  }
  view.compare.done = true;
  view.compared();
  document.body.dataset.compared = "yes";
}

// Opens the recordings of the page, or the running line.
async function start() {
  if (!document.querySelector("meta[name=line]")) {
    await startRecording();
    return;
  }
  const line = new Line();
  say("Waiting for the line.");
  line.addEventListener("locked", () => {
    say("Sign in to see the line.");
    if (!document.body.dataset.told) { // the user may cancel and try again
      byId("desk").replaceChildren(element("button", { onclick: () => line.signing.open() }, "Sign in"));
      byId("desk").hidden = false;
    }
    line.signing.open();
  });
  line.addEventListener("begin", ({ detail }) => {
    say("");
    const story = new Story(detail.head), recording = new LiveRecording(detail.head);
    story.add(detail.story);
    const view = new View(recording, story, null, line, detail);
    wire(view);
    view.resize();
    view.receive();
    document.body.dataset.told = "yes";
    view.link.follow();
    run(view);
  }, { once: true });
}

function run(view) {
  let before = performance.now();
  const loop = (now) => {
    view.clock.advance(Math.min(0.25, (now - before) / 1000));
    before = now;
    if (view.dirty) {
      view.dirty = false;
      view.draw(now);
      view.link.update();
      document.body.dataset.ready = "yes";
    }
    requestAnimationFrame(loop);
  };
  requestAnimationFrame(loop);
}

async function startRecording() {
  const source = openSource(), { recording, story, failed } = await opened(source), { head } = recording, parts = head.times.stories;
  const behind = { bytes: (name) => source.bytes(`other/${name}`) }, other = head.compared ? await opened(behind) : null;
  const view = new View(recording, story, other);
  wire(view);
  view.resize();
  let unread = failed || other?.failed || "";
  warn(unread);
  const failure = view.story.marks.findLast(({ kind }) => kind === "failed");
  if (failure) {
    warn(failure.text);
    view.clock.seek(Math.max(recording.start, failure.time - 5));
  }
  const linked = view.link.follow();
  if (!failure && !linked) view.clock.seek(await fullest(source) * head.tick);
  await Promise.all(view.clock.all.map((one) => one.load(one.number(view.clock.time))));
  view.snap();
  view.link.opened = linked ? null : view.clock.time;
  run(view);
  // The story of a long recording is read while the page already draws.
  for (let part = 0; parts > 1 && part < parts; part++) {
    say(`Reading the events: ${Math.round((100 * part) / parts)} %`);
    unread = await told(source, part, (more) => view.toldMore(more)) || unread;
  }
  if (parts > 1) warn(unread);
  document.body.dataset.told = "yes";
  for (let part = 0; other && part < other.recording.head.times.stories; part++) {
    if (other.recording.head.times.stories > 1) unread = await told(behind, part, (more) => view.toldMoreOf(other.story, more)) || unread;
  }
  if (other) await Promise.all([compare(view, source, head.compared), readPeaks(view, source, head.compared)]);
}

start().catch((error) => {
  warn(`This recording can't be shown: ${error.message}`);
});
