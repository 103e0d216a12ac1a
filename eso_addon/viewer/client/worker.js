// SPDX-License-Identifier: GPL-3.0-or-later
// The other thread: everything between the line and the buffers that are drawn.
import { finest } from './finest.js';
import { Held, Line } from './line.js';
import { Picture } from './picture.js';
import { Stream } from './stream.js';

let stream;
let pictures;
let wire = false;

/** Pass on what the stream tells; a level goes with the buffers that it changes, handed over, not copied. */
function tell(message) {
  const buffers = [];
  if (message.type === 'level') {
    pictures ??= stream.meshes.map((mesh) => new Picture(mesh));
    message.changes = message.changes.map(({ mesh, places }) => ({ mesh, ...pictures[mesh].take(places, wire) }));
    for (const change of message.changes) {
      for (const value of Object.values(change)) if (value?.buffer) buffers.push(value.buffer);
    }
  }
  postMessage(message, buffers);
}

const actions = {
  open({ url, base64, wish }) {
    const line = base64 ? new Held(Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))) : new Line(url);
    stream = new Stream(line, tell);
    stream.want(wish);
    stream.run();
  },
  wish: ({ wish }) => stream.want(wish),
  drawn: () => stream.drawn(),
  again: () => stream.again(),
  wire(message) {
    wire = message.on;
    stream.levels = [];
    stream.present();
  },
  /** The meshes as they are there, for whoever wants to look at every byte. */
  dump({ id }) {
    const meshes = stream.meshes.map((mesh) => finest(mesh));
    postMessage({ type: 'dump', id, meshes });
  },
};
onmessage = ({ data }) => actions[data.type](data);
