// SPDX-License-Identifier: GPL-3.0-or-later
// The other thread: everything between the line and the buffers that are drawn.
import { finest } from './finest.js';
import { makeLine } from './line.js';
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
const stream = makeStream(makeLine(url), wish, show, (message) => postMessage(message));
let pictures;

/** Hand the buffers of a new level over. */
function show(places, first) {
  pictures ??= stream.meshes.map(makePicture);
  const changes = pictures.map((picture, at) => (places[at] < 0 ? null : picture(places[at], wish.wire)));
  const arrays = changes.flatMap((change) => Object.values(change ?? {})).flat(2).filter(ArrayBuffer.isView);
  postMessage({ type: 'level', changes, first }, arrays.map((array) => array.buffer));
}

const actions = {
  want: (wishes) => stream.want(wishes),
  drawn: () => stream.drawn(),
  again: () => stream.again(),
  /** The meshes as they are there, for whoever wants to look at every byte. */
  dump: (_, [port]) => port.postMessage(stream.meshes.map((mesh) => finest(mesh))),
};
onmessage = ({ data: [action, wishes], ports }) => actions[action](wishes, ports);
