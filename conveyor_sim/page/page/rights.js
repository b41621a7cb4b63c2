// SPDX-License-Identifier: Apache-2.0
// What the user may do now: the reason why a request would be refused, and controls that are disabled with that reason.

const PEOPLE_NAMES = { operator: "an operator", engineer: "an engineer", controller: "a controller", test: "a test user", viewer: "a viewer" };
const listed = (names) => (names.length > 1 ? `${names.slice(0, -1).join(", ")} or ${names[names.length - 1]}` : names.join());
const anyOf = (roles) => listed(roles.map((role) => PEOPLE_NAMES[role]));
const REASONS = new WeakMap(); // by control, a function that returns the reason

export class Rights {
  // rights: by operation and role, as the server states them.
  constructor(desk, rights) {
    Object.assign(this, { desk, rights });
  }

  // Returns why a request would be refused, and what to do; "": nothing is known against it.
  refusal(what, names = [], values = []) {
    const { rights, desk: { status, view: { line } } } = this, { name, role } = line.person;
    const roles = what === "control" ? rights.control : rights.operations[what] ?? [];
    if (!line.connected || status.lost) return "There is no connection to the line.";
    if (!name) return `Sign in as ${anyOf(roles)}.`;
    if (!roles.includes(role)) return `This is for ${anyOf(roles)}; ${name} is ${PEOPLE_NAMES[role]}.`;
    if (what === "control") return "";
    if (rights.over.includes(status.run)) return status.run === "replaying" ? "A recording takes no commands." : `The run has ${status.run}: reset it first.`;
    const each = what === "set" ? this._command : what === "mode" ? this._mode : null;
    return each ? names.map((one, i) => each.call(this, one, values[i], role)).find(Boolean) ?? "" : "";
  }

  _now(device) {
    return this.desk.view.recording.latest(`${device}/mode`) ?? this.rights.automatic;
  }

  _command(name, value, role) {
    const { rights, desk } = this;
    if (desk.view.recording.tags.get(name)?.role === "panel") return rights.panel.includes(role) ? "" : `The panel is for ${anyOf(rights.panel)}.`;
    const device = desk.view.recording.tags.get(name)?.device ?? "", now = this._now(device);
    const isStop = rights.people.includes(role) && name.endsWith(rights.stop.name);
    if (rights.commands[role].includes(now) || (isStop && rights.stop.values.includes(value))) return "";
    const other = rights.commands[role].filter((mode) => this._may(role, now, mode)).pop();
    const todo = other === undefined ? ` Ask ${anyOf(this._setters(now))} to change it.` : ` Set its mode to ${rights.texts[other]} first.`;
    return `${device} is in ${rights.texts[now]}.${todo}${isStop ? " Stop and Abort are always possible." : ""}`;
  }

  _mode(device, value, role) {
    const now = this._now(device), { texts, mode_objections: objections } = this.rights;
    if (!this._may(role, now, value ?? now)) {
      const reserved = this._may(role, now, now) ? value : now;
      return `${texts[reserved]} is for ${anyOf(this._setters(reserved))}.`;
    }
    const objection = objections[this.desk.view.recording.latest(`${device}/state`)];
    return objection ? `${device} ${objection}.` : "";
  }

  _may(role, from, to) {
    return [from, to].every((mode) => this.rights.modes[role]?.includes(mode));
  }

  _setters(mode) {
    return Object.keys(this.rights.modes).filter((role) => this.rights.modes[role].includes(mode));
  }
}

// Returns a control that is disabled while `why` returns a reason.
export function guarded(control, why) {
  REASONS.set(control, why);
  control.dataset.guarded = "";
  return control;
}

// Disables the controls in a part of the page that would be refused, and writes the reasons into a note.
export function restrict(root, note = null) {
  const reasons = new Set();
  for (const control of root.querySelectorAll("[data-guarded]")) {
    const reason = REASONS.get(control)();
    if (control.disabled !== Boolean(reason)) control.disabled = Boolean(reason);
    if (control.title !== reason) control.title = reason;
    if (reason && !control.matches("option")) reasons.add(reason);
  }
  if (!note) return;
  const text = [...reasons].join(" ");
  if (note.textContent !== text) note.textContent = text;
  note.hidden = !text;
}
