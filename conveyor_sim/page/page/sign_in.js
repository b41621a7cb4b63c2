// SPDX-License-Identifier: Apache-2.0
// The sign-in dialog.

import { element } from "./dom.js";

export class SignIn {
  // done: called after a sign-in.
  constructor(line, done = () => {}) {
    Object.assign(this, { line, done });
    this.name = element("input", { autocomplete: "username", required: true, maxlength: "40" });
    this.password = element("input", { type: "password", autocomplete: "current-password", required: true, maxlength: "200" });
    this.wrong = element("p", { class: "wrong", role: "alert" });
    this.dialog = element("dialog", { id: "signing", "aria-label": "Sign in" }, element("h2", {}, "Sign in"),
      element("form", { onsubmit: (event) => this._submit(event) }, element("label", {}, "Name", this.name), element("label", {}, "Password", this.password),
        this.wrong, element("div", { class: "choices" }, element("button", { class: "main" }, "Sign in"), element("button", { type: "button", onclick: () => this.dialog.close() }, "Cancel"))));
    document.body.append(this.dialog);
  }

  open() {
    this.wrong.textContent = "";
    if (!this.dialog.open) this.dialog.showModal();
  }

  async _submit(event) {
    event.preventDefault();
    this.wrong.textContent = "…";
    const { refused } = await this.line.ask({ do: "sign_in", name: this.name.value, password: this.password.value });
    this.password.value = "";
    this.wrong.textContent = refused;
    if (refused) return;
    this.dialog.close();
    this.done();
  }
}
