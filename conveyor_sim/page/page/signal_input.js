// SPDX-License-Identifier: Apache-2.0
// A field for the name of a signal. An unknown name is refused beside it, with the nearest names as buttons.

import { element } from "./dom.js";

const MOST = 3; // names that are offered
const LEAST = 0.25; // similarity of a name that is offered

const pairsOf = (text) => new Set(Array.from({ length: Math.max(0, text.length - 1) }, (_, i) => text.slice(i, i + 2)));

// Returns the names that are most similar to a text by their pairs of letters.
function nearest(text, names) {
  const wanted = pairsOf(text.toLowerCase());
  const alike = (name) => {
    const pairs = pairsOf(name.toLowerCase()), shared = [...wanted].filter((pair) => pairs.has(pair)).length;
    return (2 * shared) / Math.max(1, wanted.size + pairs.size);
  };
  return names.map((name) => [alike(name), name]).filter(([value]) => value > LEAST).sort(([a], [b]) => b - a).slice(0, MOST).map(([, name]) => name);
}

export class SignalInput {
  // names: returns all names. take: takes a name and returns why it is refused, or "".
  constructor(label, names, take) {
    Object.assign(this, { names, take });
    this.input = element("input", { list: "signals", placeholder: "Add a signal …", "aria-label": label, maxlength: "200", onchange: () => this._typed(), oninput: () => this._refuse("") });
    this.refusal = element("span", { class: "refusal", role: "alert" });
    this.parts = [this.input, this.refusal];
  }

  _typed() {
    const name = this.input.value.trim(), names = this.names();
    if (!name) return;
    const isKnown = names.includes(name), refused = isKnown ? this.take(name) : `No signal is named ${name}.`;
    this._refuse(refused, isKnown ? [] : nearest(name, names));
    if (!refused) this.input.value = "";
  }

  _refuse(reason, others = []) {
    this.input.setAttribute("aria-invalid", Boolean(reason));
    const offer = (name) => element("button", { class: "link", onclick: () => { this.input.value = name; this._typed(); } }, name);
    this.refusal.replaceChildren(reason, ...(others.length ? [" Did you mean ", ...others.flatMap((name, i) => [i ? ", " : "", offer(name)]), "?"] : []));
  }
}
