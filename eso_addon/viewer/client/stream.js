// SPDX-License-Identifier: GPL-3.0-or-later
// A file on its way in: asks for as much as is wanted, decodes it, and tells which level of each mesh to show.
import { FIXED, StreamError, check, crc32, readFixed, readHead } from './container.js';
import { digest } from './finest.js';
import { base, batch, makeMesh } from './mesh.js';

const FIRST = 8192; // bytes asked for at first: the first picture comes from them
const PATIENCE = 400; // milliseconds that the first picture waits for more than the base
const STEP = 250; // milliseconds between pictures while more comes
const BUSY = 1000; // where it is decoding that takes the time
const SLOW = 200; // where it is the line: what came is then spread until more comes, and
const SPARE = 400; // so many milliseconds beyond
const now = () => performance.now();
const { port1, port2 } = new MessageChannel();
const breath = () => new Promise((resolve) => { port1.onmessage = resolve; port2.postMessage(0); });

/**
 * Load what `line` gives, as `wish` says, for as long as the page lives. `show` is given the places of each mesh in a new level
 * (-1: as before), and of the first one what it took; `tell` takes { type, ... } messages for the page.
 */
export function makeStream(line, wish, show, tell) {
  const begun = now();
  const waiting = new Set();
  let file = new Uint8Array(FIRST);
  let head;
  let rows = [];
  let meshes = [];
  let received = 0;
  let splits = 0;
  let busy = 0; // milliseconds spent on splits
  let paid = 0; // until when the budget is spent
  let lately = []; // [time, bytes] of what came within a second
  let pace = { time: begun, bytes: 0 };
  let speed = 0; // bytes a second
  let abort;
  let trouble = {}; // what is wrong now: { message, failed }
  let based; // when the base was there
  let levels = []; // places of each mesh in the last picture
  let shown = 0; // their triangles
  let drawing = false;
  let posted = -Infinity; // the first picture waits for none before it
  let timer;
  let told = 0;
  let whole = {};
  let breathed = 0;

  /** Take new wishes of the page. */
  function want(wishes) {
    Object.assign(wish, wishes);
    // of other wishes the next part asks; without ranges the line is held, not left
    if (line.ranges && (wishes.paused || 'budget' in wishes)) abort?.abort();
    wake();
    if ('wire' in wishes) levels = levels.map(() => -1); // the same anew
    present(!wishes.views);
    report();
  }

  function wake() {
    for (const resolve of waiting) resolve();
    waiting.clear();
  }

  /** Wait until something is said, or so many milliseconds. */
  const change = (milliseconds) => new Promise((resolve) => {
    waiting.add(resolve);
    if (milliseconds !== undefined) setTimeout(resolve, milliseconds); // also none: two clock readings may meet
  });

  async function run() {
    for (let attempt = 0; ; ) {
      const before = received;
      try {
        if (!(await next())) await change();
        attempt = 0;
      } catch (error) {
        if (received > before) attempt = 0;
        const known = error instanceof StreamError;
        const large = error instanceof RangeError && /alloc|length/i.test(error.message);
        let text = known ? error.message : large ? 'The mesh is too large for this device.' : 'The file is damaged.';
        const seconds = Math.min(0.5 * 2 ** attempt++, 10);
        if (error.again) text += ` What came is shown; trying again in ${Math.ceil(seconds)} s.`;
        present(true); // what came is shown, before it is said
        complain(text, !error.again);
        if (error.again) await change(1000 * seconds);
        while (trouble.failed) await change();
        if (!head && !error.again) received = 0;
      }
    }
  }

  function complain(message, failed = false) {
    trouble = { message, failed };
    report();
  }

  /** Try once more after a failure or a broken line. */
  function again() {
    for (const row of rows) row.bad = 0;
    complain('');
    wake();
  }

  // -- bytes -------------------------------------------------------------------------------------------------------

  /**
   * Wait until the budget allows some bytes; gives how many. With these no second has more than its bytes, whenever they come: they are
   * asked for when what came in the second before leaves room for them.
   */
  async function allowance() {
    for (;;) {
      const { budget } = wish;
      if (!budget) return Infinity;
      const least = Math.min(Math.max(50, 1024000 / budget), 500); // milliseconds of the line that are worth a request
      const time = now();
      paid = Math.max(paid, time - 2 * least);
      lately = lately.filter(([at]) => at > time - 1000);
      const most = Math.min(time - paid, 1000 - (1000 * lately.reduce((sum, [, bytes]) => sum + bytes, 0)) / budget);
      if (most >= least) return Math.floor((most * budget) / 1000);
      await change(Math.ceil(least - Math.max(most, 0)));
    }
  }

  /** Take in a part of the file. */
  function keep(part, at) {
    const end = at + part.length;
    if (end > file.length) file = new Uint8Array(file.buffer.transfer(Math.max(end, 2 * file.length)));
    file.set(part, at);
    mark(at, end);
    received += part.length;
    const time = now();
    if (wish.budget) {
      paid += (1000 * part.length) / wish.budget;
      lately.push([time, part.length]);
    }
    pace.bytes += part.length;
    if (time > pace.time + 200) {
      const last = (1000 * pace.bytes) / (time - pace.time);
      speed = speed ? (speed + last) / 2 : last;
      pace = { time, bytes: 0 };
    }
    if (trouble.message) complain('');
    else if (wish.budget || time > told + 60) report();
  }

  /** Note that the blocks have these bytes of the file. */
  function mark(at, end) {
    for (const row of rows) {
      const due = row.begin + row.have;
      if (at <= due && due < end) row.have = Math.min(end - row.begin, row.length);
    }
  }

  /** How many bytes the header needs, as far as that is known. */
  const needed = () => (received < FIXED ? FIXED : readFixed(file).end);

  /** Begin and end of what is to be fetched next; nothing where nothing is wanted. */
  function span() {
    if (!head) return [received, Math.max(FIRST, needed())];
    const first = rows.findIndex(wanted);
    if (first < 0) return null;
    let last = first;
    while (last + 1 < rows.length && wanted(rows[last + 1])) last++;
    return [rows[first].begin + rows[first].have, rows[last].begin + rows[last].length];
  }

  /** Fetch and decode what is wanted next; false where nothing is. */
  async function next() {
    if (head) await decode();
    const most = span() && (await allowance());
    const asked = span(); // meanwhile the wish may have changed
    if (!asked) return false;
    let [begin, end] = asked;
    check(!line.size || begin < line.size, 'The file is cut short. What came is shown.');
    end = Math.min(end, begin + most);
    abort = new AbortController();
    const { signal } = abort;
    try {
      for await (const part of line.read(begin, end, signal)) {
        keep(part, begin);
        begin += part.length;
        await (head ? decode() : open());
        if (line.ranges) {
          const row = rows.find((one) => !one.done && one.begin + one.length > begin);
          if (signal.aborted || (row && !wanted(row))) break;
        } else {
          while (wish.paused && based) await change();
          await allowance();
        }
      }
    } catch (error) {
      if (!signal.aborted) throw error;
    }
    return true;
  }

  /** Read header and table once they are there. */
  async function open() {
    if (received < needed()) return;
    const { header, ...found } = await readHead(file, readFixed(file));
    rows = found.rows;
    const previous = [];
    let total = found.meshes.reduce((sum, mesh) => sum + mesh.extra, 0);
    let bytes = 0;
    for (const row of rows) {
      const before = previous[row.mesh];
      const { places, faces } = before ?? { places: 0, faces: 0 };
      total += row.faces - faces;
      // positions, normals and what predicts them: about 60 bytes a place, 40 a face
      bytes += 60 * (row.places - places) + 40 * (row.faces - faces);
      Object.assign(row, { before, total, have: 0, bad: 0, tooMuch: before && bytes > 1e6 * wish.memory });
      previous[row.mesh] = row;
    }
    meshes = found.meshes.map((mesh, at) => makeMesh(mesh, rows.findLast((row) => row.mesh === at && !row.tooMuch)));
    head = { faces: total, base: rows[meshes.length - 1].total };
    tell({
      type: 'head', ...head, meta: header.meta ?? {}, bytes: found.end, tooMuch: rows.some((row) => row.tooMuch),
      meshes: meshes.map((mesh) => ({
        wedges: mesh.wedgeParents.length, corners: mesh.faces.length, meta: mesh.head.meta ?? {},
      })),
    });
    mark(0, received);
    await decode();
  }

  /** Triangles of all meshes in the level that is asked for. */
  const levelFaces = () => (wish.level < 1 ? Math.round(head.base * (head.faces / head.base) ** wish.level) : Infinity);

  /** What the camera sees of a mesh. */
  const sight = (mesh) => wish.views?.[mesh] ?? { visible: true, scale: 0 };

  /** Whether a block shall be fetched. */
  function wanted(row) {
    if (row.done || row.tooMuch) return false;
    if (!row.before) return true;
    const { visible, scale } = sight(row.mesh);
    if (wish.paused || !visible || row.before.total >= levelFaces()) return false;
    const pixels = row.before.error * scale; // 0 where unknown
    return !wish.error || (scale > 0 && !(pixels > 0 && pixels <= wish.error));
  }

  // -- splits ------------------------------------------------------------------------------------------------------

  async function decode() {
    for (const row of rows) {
      if (row.done || row.have < row.length || row.tooMuch || (row.before && !row.before.done)) continue;
      const data = file.subarray(row.begin, row.begin + row.length);
      if (crc32(data) !== row.crc) {
        row.have = 0; // asked for once more, in case the line did it
        check(++row.bad < 2, `The file is damaged at block ${rows.indexOf(row)} of ${rows.length}. What came before it is shown.`);
        return;
      }
      const time = now();
      try {
        await (row.before ? batch : base)(meshes[row.mesh], data, row.places, row.faces);
      } catch (error) {
        for (const other of rows) if (other.mesh === row.mesh && !other.done) other.tooMuch = true;
        throw error;
      }
      busy += now() - time;
      splits += row.before ? row.places - row.before.places : 0;
      row.done = true;
      if (now() < breathed + 12) continue;
      present();
      await breath();
      breathed = now();
    }
    present();
    if (!rows.every((row) => row.done) || whole.seconds) return;
    let identical = true;
    for (const mesh of meshes) identical &&= (await digest(mesh)) === mesh.head.hash;
    whole = { identical, quantised: meshes.some((mesh) => mesh.head.bits), seconds: (now() - begun) / 1000 };
    complain(identical ? '' : 'What came is not what was sent: the file is damaged. Load it anew.');
  }

  // -- pictures ----------------------------------------------------------------------------------------------------

  /** Show the level that is wanted, there, and on a slow line not so fine that nothing is left until more comes. */
  function present(hurry) {
    if (!head || drawing || !mayBegin()) return;
    clearTimeout(timer);
    const open = rows.filter(wanted);
    const rate = speed || wish.budget;
    const slow = open.length > 0 && rate > 0 && line.size > rate; // all of it takes more than a second
    const rest = posted + (slow ? SLOW : 2 * busy > now() - begun ? BUSY : STEP) - now();
    if (open.length && rest > 0 && !hurry) {
      timer = setTimeout(present, rest);
      return;
    }
    let target = Math.min(levelFaces(), wish.cap || Infinity);
    const left = there() - shown;
    if (slow && shown && left > 0) {
      const due = (1000 * (open[0].length - open[0].have)) / rate;
      target = Math.min(target, shown + Math.ceil((left * SLOW) / (due + SPARE)));
      timer = setTimeout(present, SLOW);
    }
    const places = placesFor(target);
    if (places.every((count, at) => count === levels[at])) return;
    const first = !levels.length;
    const changed = places.map((count, at) => (count === levels[at] ? -1 : count));
    levels = places;
    shown = meshes.reduce((sum, mesh, at) => sum + (mesh.facesAfter[places[at] - 1] ?? 0), 0);
    drawing = true;
    posted = now();
    show(changed, first ? { bytes: rows[0].begin + rows.reduce((sum, row) => sum + (row.done ? row.length : 0), 0), time: now() - begun } : null);
    report();
  }

  /** The first picture waits for all of the first bytes, but not for long. */
  function mayBegin() {
    if (levels.length) return true;
    if (!rows.every((row) => row.before || row.done)) return false;
    based ??= now();
    const last = rows.findLast((row) => row.begin + row.length <= FIRST);
    const rest = based + PATIENCE - now();
    if (!last || last.done || rest <= 0) return true;
    clearTimeout(timer);
    timer = setTimeout(present, rest);
    return false;
  }

  /** Triangles as far as they are decoded. */
  const there = () => meshes.reduce((sum, mesh) => sum + mesh.faceCount, 0);

  /** Places of each mesh in the level with so many triangles. */
  function placesFor(target) {
    const places = [];
    for (const row of rows) {
      if (!row.done) continue;
      if (!row.before || row.total <= target) places[row.mesh] = row.places;
      else if (places[row.mesh] === row.before.places) {
        const { facesAfter, faceCount } = meshes[row.mesh];
        let last = row.places;
        while (last > row.before.places && row.total - facesAfter[row.places - 1] + facesAfter[last - 1] > target) last--;
        places[row.mesh] = last;
      }
    }
    return places;
  }

  /** The error on screen of what is shown of a mesh, in pixels; infinite where unknown. */
  function errorOf(places, mesh) {
    const { visible, scale } = sight(mesh);
    const own = rows.filter((row) => row.mesh === mesh);
    const row = own.findLast((one) => one.places <= places);
    if (!visible || row === own.at(-1)) return 0;
    return row?.error ? row.error * scale : Infinity;
  }

  /** Tell how far all is. */
  function report() {
    told = now();
    const pixels = Math.max(-1, ...levels.map(errorOf));
    tell({
      type: 'state', received, there: there(), shown, splits, message: '', ...trouble, ...whole, pixels: pixels < Infinity ? pixels : -1,
      rate: busy && (1000 * splits) / busy, waiting: rows.some((row) => !row.done) && !rows.some(wanted),
    });
  }

  run();
  return {
    want,
    again,
    get meshes() {
      return meshes;
    },
    /** The page has drawn. */
    drawn() {
      drawing = false;
      present();
    },
  };
}
