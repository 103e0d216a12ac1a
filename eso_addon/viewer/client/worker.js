// SPDX-License-Identifier: GPL-3.0-or-later
// The other thread: everything between the line and the buffers that are drawn.
import { finest } from './finest.js';
import { makeHeld, makeLine } from './line.js';
import { makePicture } from './picture.js';
import { makeStream } from './stream.js';
// what these import, named here so that all is asked for at once
import './container.js';
import './hash.js';
import './mesh.js';
import './batch.js';
import './coder.js';
import './columns.js';
import './fan.js';
import './positions.js';

const { url, wish } = JSON.parse(name);
let stream = url && begin(makeLine(url));
let pictures;
let wire;

function begin(line) {
  return makeStream(line, wish, show, (message) => postMessage(message));
}

/** Hand the buffers of a new level over. */
function show(places, first) {
  pictures ??= stream.meshes.map(makePicture);
  const changes = pictures.map((picture, at) => (places[at] < 0 ? null : picture(places[at], wire)));
  const arrays = changes.flatMap((change) => Object.values(change ?? {})).filter(ArrayBuffer.isView);
  postMessage({ type: 'level', changes, first }, arrays.map((array) => array.buffer));
}

const actions = {
  held({ base64 }) {
    stream = begin(makeHeld(Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))));
  },
  wish: (message) => stream.want(message.wish),
  drawn: () => stream.drawn(),
  again: () => stream.again(),
  wire({ on }) {
    wire = on;
    stream.renew();
  },
  /** The meshes as they are there, for whoever wants to look at every byte. */
  dump: ({ id }) => postMessage({ type: 'dump', id, meshes: stream.meshes.map((mesh) => finest(mesh)) }),
};
onmessage = ({ data }) => actions[data.type](data);
