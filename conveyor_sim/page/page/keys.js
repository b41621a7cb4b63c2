// SPDX-License-Identifier: Apache-2.0
// Keyboard shortcuts, as in a video player.

import { byId, element } from "./dom.js";
import { MARKS } from "./scrubber.js";

const TABLE = [
  ["Space, K", "play or pause"], ["← →", "one second back, ahead"], ["Shift ← →", "ten seconds back, ahead"], [", .", "one frame back, ahead"],
  ["< >", "slower, faster"], ["Home End", "to the start, the end"], ["0 to 9", "to tenths of the recording"], ["N P", "next, previous alarm, fault or failure"],
  ["+ −", "zoom"], ["W A S D", "move the plan"], ["Z", "whole plant"], ["G", "zoom to the selected device or bottle"], ["B, shift B", "choose the next, the previous bottle"], ["F", "follow the chosen bottle"], ["C", "next colouring of bottles"], ["H", "next heat map"], ["T", "trends"], ["Esc", "let go of what is chosen"], ["?", "these keys"],
];

const table = (rows) => element("table", {}, ...rows.map(([sign, what]) => element("tr", {}, element("th", {}, sign), element("td", {}, what))));

export function listenToKeys(view) {
  const { clock, camera, clock: { recording } } = view, dialog = byId("keys");
  dialog.append(element("div", { class: "columns" },
    element("div", {}, element("h2", {}, "Keys"), table(TABLE)), element("div", {}, element("h2", {}, "Marks on the time line"), table(MARKS))),
    element("button", { onclick: () => dialog.close() }, "Close"));
  byId("help").addEventListener("click", () => dialog.showModal());
  const seek = (time) => {
    clock.seek(time);
    view.snap();
  };
  const pan = (x, y) => {
    view.setFollowing(false);
    camera.pan(x, y);
  };
  const actions = {
    " ": () => clock.toggle(), k: () => clock.toggle(),
    ArrowLeft: (event) => seek(clock.time - (event.shiftKey ? 10 : 1)), ArrowRight: (event) => seek(clock.time + (event.shiftKey ? 10 : 1)),
    ",": () => clock.step(-1), ".": () => clock.step(1), "<": () => clock.faster(-1), ">": () => clock.faster(1),
    Home: () => seek(recording.start), End: () => seek(recording.end), n: () => view.nextMark(1), p: () => view.nextMark(-1),
    "+": () => camera.zoom(1.25), "=": () => camera.zoom(1.25), "-": () => camera.zoom(0.8), z: () => view.wholePlant(), g: () => view.zoomToSelection(),
    w: () => pan(0, 60), s: () => pan(0, -60), a: () => pan(60, 0), d: () => pan(-60, 0),
    b: () => view.nextBottle(1), B: () => view.nextBottle(-1), f: () => view.setFollowing(!view.following), c: () => view.nextColouring(), h: () => view.nextHeat(), t: () => byId("toggle_trends").click(),
    Escape: () => view.letGo(), "?": () => dialog.showModal(),
  };
  let pointed = false; // true while a pointer set the focus: Space plays, and does not press the clicked button again
  addEventListener("pointerdown", () => { pointed = true; }, true);
  const plays = (event) => event.key === " " && pointed;
  addEventListener("keyup", (event) => {
    if (plays(event) && event.target.matches("button")) event.preventDefault(); // Firefox presses a button then
  });
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || dialog.open) return;
    const target = event.target, typing = target.matches("input:not([type=checkbox]), select");
    const pressing = target.matches("button, input[type=checkbox], [role=tab], [role=button]") && [" ", "Enter"].includes(event.key);
    const tabbing = target.matches("[role=tab]") && event.key.startsWith("Arrow");
    if (tabbing || event.key === "Tab") pointed = false;
    if (typing || tabbing || (pressing && !plays(event))) return;
    const digit = /^[0-9]$/.test(event.key);
    const action = digit ? () => seek(recording.start + (+event.key / 10) * (recording.end - recording.start)) : actions[event.key] ?? actions[event.key.toLowerCase()];
    if (!action) return;
    event.preventDefault();
    action(event);
  });
}
