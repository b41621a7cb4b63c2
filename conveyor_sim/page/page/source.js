// SPDX-License-Identifier: Apache-2.0
// Sources of the page's data, bytes by name ("head", "fullest", "story/0", "block/0"): the page itself, or a server.

import { byId, say, warn } from "./dom.js";

const AGAIN = 2000; // ms
const NO_ANSWER = "● No answer from the server: trying again";

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

class Embedded {
  constructor(elements) {
    this.parts = new Map(Array.from(elements, (element) => [element.dataset.part, element]));
  }

  async bytes(name) {
    const text = atob(this.parts.get(name).textContent.trim());
    return inflated(Uint8Array.from(text, (letter) => letter.charCodeAt(0)));
  }
}

class Served {
  async bytes(name) {
    const [answer, bytes] = await this._answer(name);
    if (!answer.ok) throw new Error(new TextDecoder().decode(bytes).trim() || `${name}: ${answer.status}`);
    return inflated(bytes);
  }

  // A request without an answer is repeated, and the page shows a notice in the meantime.
  async _answer(name) {
    for (;;) {
      try {
        const answer = await fetch(`data/${name}`), bytes = new Uint8Array(await answer.arrayBuffer());
        this._link(true);
        return [answer, bytes];
      } catch {
        this._link(false);
        await new Promise((over) => setTimeout(over, AGAIN));
      }
    }
  }

  _link(there) {
    if (!there) warn(NO_ANSWER);
    else if (byId("notice").textContent === NO_ANSWER) say("");
    document.body.dataset.link = there ? "served" : "broken";
  }
}

export function openSource() {
  const elements = document.querySelectorAll("script[data-part]");
  return elements.length ? new Embedded(elements) : new Served();
}
