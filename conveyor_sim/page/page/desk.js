// SPDX-License-Identifier: Apache-2.0
// The bar of a running line: connection, latency, run, and user.

import { byId, element, seconds, warn } from "./dom.js";
import { wallTime } from "./live.js";
import { Rights, guarded, restrict } from "./rights.js";

const SURE = 5000; // ms within which a second click confirms
const STANDS = ["paused", "ended", "stopped"]; // states of a run in which time stands
const TOLD = 500; // ms between two updates of the latency
const STALE = 2; // s without a frame of a running line after which the bar reports it
const READABLE = 3; // s for which a refusal is shown at least, unless the user goes on
const REMEMBERED = 20; // s in which a refusal by the line is attributed to a request of this page

export class Desk {
  constructor(view, about) {
    Object.assign(this, { view, about, status: about.status, latency: 0, told: 0, requests: new Map(), edits: 0 });
    const { line } = view;
    this.rights = new Rights(this, about.rights);
    this.why = element("small", { id: "why", class: "reason", hidden: true });
    byId("side").addEventListener("input", () => { this.edits += 1; });
    this.link = element("span", { id: "link", role: "status" });
    this.late = element("span", { id: "latency", title: "Latency: from the tick of the line to its frame on this screen" });
    this.run = element("span", { id: "run" });
    this.buttons = new Map();
    const can = about.users ? about.controls : [];
    const controls = [["pause", "Pause run", []], ["resume", "Resume run", []], ["step", "Step one tick", [1]], ["reset", "Reset run", []]]
      .filter(([what]) => can.includes(what)).map(([what, label, values]) => {
        const button = guarded(element("button", { onclick: () => (what === "reset" ? this._sure(button, label) : this.ask("control", [what], values)) }, label), () => this.rights.refusal("control"));
        this.buttons.set(what, button);
        return button;
      });
    this.now = element("button", { id: "follow_now", title: "Show what is now (End)", onclick: () => view.clock.follow() }, "Now");
    this.who = element("span", { id: "who" });
    this.sign = element("button", { id: "sign", onclick: () => this._sign() }, "Sign in");
    this.signing = line.signing;
    this.signing.done = () => this.connection();
    byId("desk").replaceChildren(this.link, this.late, this.now, this.run, ...controls, this.why, element("span", { class: "gap" }), this.who, ...(about.users ? [this.sign] : []));
    byId("desk").hidden = false;
    line.addEventListener("connection", () => { this.at = this.before = null; this.connection(); });
    line.addEventListener("locked", () => this.connection());
    line.addEventListener("status", ({ detail }) => { this.status = detail.status; this.connection(); });
    setInterval(() => view.touch(), 1000 * STALE / 2); // so that missing frames are shown
    line.addEventListener("frame", ({ detail }) => { [this.before, this.at] = [this.at, detail.at]; });
    this.connection();
  }

  // True if commands are possible from this page after a sign-in.
  get commands() {
    return this.about.users && this.about.takes;
  }

  connection() {
    const { line } = this.view, { lost, run, reason, servers } = this.status;
    const state = line.locked ? "locked" : !line.connected ? "broken" : lost ? "lost" : "live";
    document.body.dataset.link = state;
    this.link.textContent = { locked: "● Sign in to see the line", broken: "● No connection to the server: trying again", lost: `● The line is lost: ${lost}`, live: "● Live" }[state];
    this.link.className = state;
    this.link.title = servers.map(({ name, text }) => `${name}: ${text}`).join("\n");
    this.run.textContent = state === "live" ? `${run}${reason ? `: ${reason}` : ""}` : "";
    this.stands = STANDS.includes(run);
    this.run.classList.toggle("stands", this.stands);
    const useful = { pause: !this.stands, resume: run === "paused", step: run === "paused", reset: true };
    for (const [what, button] of this.buttons) button.hidden = state !== "live" || !useful[what];
    this.late.hidden = state !== "live";
    const { name, role } = line.person;
    this.who.textContent = name ? `${name} (${role})` : state === "live" ? "read only" : "";
    this.sign.textContent = name ? "Sign out" : "Sign in";
    document.body.dataset.person = name;
    restrict(byId("desk"), this.why);
    this.why.hidden ||= state !== "live";
    this.view.touch();
  }

  // Called after each frame.
  drawn(now) {
    const { clock } = this.view;
    this.now.setAttribute("aria-pressed", clock.live);
    if (clock.live && this.before && this.at !== this.shown) { // the first frame may be of a stopped line
      this.shown = this.at;
      const late = wallTime() + this.view.line.offset - this.at;
      this.latency = this.latency ? 0.9 * this.latency + 0.1 * late : late;
    }
    if (now - this.told < TOLD) return;
    this.told = now;
    const age = !this.at || this.stands ? 0 : wallTime() + this.view.line.offset - this.at;
    this.late.classList.toggle("stale", clock.live && age > STALE);
    const late = this.stands ? "" : age > STALE ? `no new frame for ${age.toFixed(0)} s` : this.shown ? `${Math.max(0, Math.round(1000 * this.latency))} ms behind` : "";
    const text = clock.live ? late : `${seconds(this.view.recording.end - clock.time, 1)} ago`;
    if (this.late.textContent !== text) this.late.textContent = text;
  }

  // Sends a request to the line and shows the reason of a refusal. Returns true if it was accepted.
  async ask(what, names, values = []) {
    for (const [text, time] of this.requests) if (wallTime() > time + REMEMBERED) this.requests.delete(text);
    this.requests.set(names.join(", "), wallTime());
    const { refused } = await this.view.line.ask({ do: what, names, values });
    if (refused) this._refused(names, refused);
    else warn("");
    if (!refused) byId("said").textContent = `${what} ${names.join(", ")}: accepted`;
    return !refused;
  }

  // Shows a refusal until the user edits a value, or something changes on which it may depend.
  _refused(names, text) {
    const { line, recording } = this.view, at = wallTime(), { edits } = this;
    const devices = names.map((name) => recording.tags.get(name)?.device ?? name);
    const key = () => JSON.stringify([line.connected, line.person, this.status.run, this.status.owner, ...devices.flatMap((device) => ["mode", "state"].map((what) => recording.latest(`${device}/${what}`) ?? null))]);
    const then = key();
    warn(`Refused: ${text}`, () => edits === this.edits && (key() === then || wallTime() < at + READABLE));
  }

  // A reset discards the run, so it needs a second click.
  _sure(button, label) {
    const sure = `${label}: sure?`, isSure = button.textContent === sure;
    button.textContent = isSure ? label : sure;
    if (isSure) this.ask("control", ["reset"]);
    else setTimeout(() => { button.textContent = label; }, SURE);
  }

  // Shows requests that the line has refused one tick later.
  happened({ kind = [], name = [], text = [] }) {
    kind.forEach((one, i) => {
      if (one === "command_refused" && this.requests.has(name[i])) this._refused(name[i].split(", "), text[i]);
    });
  }

  async _sign() {
    const { line } = this.view;
    if (!line.person.name) {
      this.signing.open();
      return;
    }
    await line.ask({ do: "sign_out" });
    this.connection();
  }
}
