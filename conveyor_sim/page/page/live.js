// SPDX-License-Identifier: Apache-2.0
// A running line: frames and events come by one websocket, which reconnects. Written by
// conveyor_sim/protocols/web/feed.py. Both files must be changed together.

import { readBlock } from "./block.js";
import { SignIn } from "./sign_in.js";

const TEXT = 0, HEADER = 17; // bytes before the block of a frame
const FIRST_WAIT = 0.5, LONGEST_WAIT = 5; // s between attempts to connect
const PING = 5; // s
const SILENT = 15; // s without a message after which the connection is closed

export const wallTime = () => (performance.timeOrigin + performance.now()) / 1000;

export class Line extends EventTarget {
  constructor() {
    super();
    this.person = { name: "", role: "viewer" };
    this.offset = 0; // s by which the server's clock is ahead
    this.asked = new Map();
    this.number = 0;
    this.wait = FIRST_WAIT;
    this.connected = false;
    this.locked = false; // true if the line is shown only after a sign-in
    this.head = null;
    this.signing = new SignIn(this);
    setInterval(() => this._ping(), 1000 * PING);
    this._connect();
  }

  _connect() {
    const address = new URL("live", location.href);
    address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(address);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this._ping();
    socket.onmessage = ({ data }) => this._take(data);
    socket.onclose = () => {
      const was = this.connected;
      this.connected = this.locked = false;
      this.person = { name: "", role: "viewer" };
      for (const answer of this.asked.values()) answer({ refused: "the connection was lost before there was an answer" });
      this.asked.clear();
      this._tell("connection", was);
      setTimeout(() => this._connect(), 1000 * this.wait);
      this.wait = Math.min(LONGEST_WAIT, 1.5 * this.wait);
    };
  }

  _tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  _take(data) {
    this.heard = wallTime();
    if (new Uint8Array(data, 0, 1)[0] !== TEXT) {
      this._frame(data);
      return;
    }
    const message = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 1)));
    if (message.kind === "begin") {
      this.head = message.head;
      this.connected = true;
      this.locked = false;
      this.wait = FIRST_WAIT;
    }
    if (message.kind === "locked") {
      this.locked = true;
      this.wait = FIRST_WAIT;
    }
    if (message.kind === "pong") {
      const now = wallTime();
      this.offset = message.now - (message.sent + now) / 2;
    } else if (message.kind === "reply") {
      this.person = message.person;
      this.asked.get(message.id)?.(message);
      this.asked.delete(message.id);
    } else this._tell(message.kind, message);
  }

  _frame(data) {
    const numbers = new DataView(data), tick = numbers.getFloat64(1, true);
    try {
      const block = readBlock(new Uint8Array(data, HEADER), this.head.steps, tick, this.head.tick);
      this._tell("frame", { time: tick * this.head.tick, at: numbers.getFloat64(9, true), block });
    } finally {
      this._send({ do: "saw" });
    }
  }

  _send(request) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(request));
    return true;
  }

  _ping() {
    if (this.connected && wallTime() > this.heard + SILENT) this.socket.close();
    else this._send({ do: "ping", sent: wallTime() });
  }

  // A refused request has the reason in `refused` of the answer.
  ask(request) {
    const id = ++this.number;
    return new Promise((answer) => {
      this.asked.set(id, answer);
      if (this._send({ ...request, id })) return;
      this.asked.delete(id);
      answer({ refused: "there is no connection to the line" });
    });
  }
}
