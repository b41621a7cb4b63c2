// SPDX-License-Identifier: Apache-2.0
// The panels beside the plan, one at a time.

import { byId, element } from "./dom.js";

export class Tabs {
  // panels: by name { title, root, draw }
  constructor(panels, chosen) {
    this.panels = panels;
    this.names = Object.keys(panels);
    this.buttons = new Map();
    for (const name of this.names) {
      const button = element("button", { role: "tab", id: `tab_${name}`, "aria-controls": `panel_${name}`, onclick: () => this.show(name) }, panels[name].title);
      const panel = element("div", { role: "tabpanel", id: `panel_${name}`, "aria-labelledby": `tab_${name}`, tabindex: "0" }, ...panels[name].parts.map((part) => part.root));
      this.buttons.set(name, { button, panel });
      byId("tabs").append(button);
      byId("panels").append(panel);
    }
    byId("tabs").addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      this.show(this.names[(this.names.indexOf(this.shown) + step + this.names.length) % this.names.length]);
      this.buttons.get(this.shown).button.focus();
    });
    this.show(chosen);
  }

  show(name) {
    this.shown = name;
    for (const [other, { button, panel }] of this.buttons) {
      button.setAttribute("aria-selected", other === name);
      button.tabIndex = other === name ? 0 : -1;
      panel.hidden = other !== name;
    }
    this.draw();
  }

  badge(name, count) {
    const { button } = this.buttons.get(name), { title } = this.panels[name];
    const text = count ? `${title} ${count}` : title;
    if (button.textContent !== text) button.textContent = text;
    button.classList.toggle("urgent", count > 0);
  }

  draw() {
    for (const part of this.panels[this.shown].parts) part.draw();
  }
}
