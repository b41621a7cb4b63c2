// Where a page's data comes from: bytes by name ("head", "story", "block/0"). A recording in the page itself, or a server.

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
    const answer = await fetch(`data/${name}`);
    if (!answer.ok) throw new Error((await answer.text()).trim() || `${name}: ${answer.status}`);
    return inflated(new Uint8Array(await answer.arrayBuffer()));
  }
}

export function openSource() {
  const elements = document.querySelectorAll("script[data-part]");
  return elements.length ? new Embedded(elements) : new Served();
}
