// SPDX-License-Identifier: GPL-3.0-or-later
// A file on its way in: asks for as much as is wanted, decodes it, and tells which level of each mesh to show.
import { FIXED, StreamError, crc32, readFixed, readHead } from './container.js';
import { digest } from './finest.js';
import { LineError } from './line.js';
import { Mesh } from './mesh.js';

const FIRST = 8192; // bytes asked for at first: the first picture comes from them
const PATIENCE = 400; // milliseconds that the first picture waits for more than the base
const QUIET = 120; // milliseconds at least between pictures while more comes, where the next has four times as much
const LONG = 400; // and at most
const STEP = 250; // milliseconds between steps where a slow line makes a batch's splits last until the next
const now = () => performance.now();
const { port1, port2 } = new MessageChannel();
const breath = () => new Promise((resolve) => { port1.onmessage = resolve; port2.postMessage(0); });

export class Stream {
  /** `tell`: takes { type, ... } messages for the page. */
  constructor(line, tell) {
    this.line = line;
    this.tell = tell;
    this.wish = { paused: false, budget: 0, error: 0, faces: Infinity, cap: Infinity, memory: Infinity, views: [] };
    this.received = this.decoded = this.splits = 0;
    this.begun = now();
    this.busy = 0; // milliseconds spent on splits
    this.tokens = 0;
    this.speed = 0; // bytes a second, as measured
    this.first = new Uint8Array(0);
    this.shown = 0; // triangles of all meshes in the last picture
    this.levels = [];
    this.changed = new Set();
  }

  /** Take new wishes of the page. */
  want(wish) {
    Object.assign(this.wish, wish);
    if (wish.paused || wish.budget !== undefined) this.abort?.abort(); // of other wishes the next part asks
    if (wish.faces !== undefined || wish.cap !== undefined) this.hurry = true;
    this.wake();
    this.present();
  }

  wake() {
    for (const resolve of this.changed) resolve();
    this.changed.clear();
  }

  /** Wait until something is said, or so many milliseconds. */
  change(milliseconds) {
    return new Promise((resolve) => {
      this.changed.add(resolve);
      if (milliseconds) setTimeout(resolve, milliseconds);
    });
  }

  /** Load for as long as the page lives. */
  async run() {
    for (let attempt = 0; ; ) {
      const before = this.received;
      try {
        if (!this.head) await this.open();
        else if (!(await this.next())) await this.change();
        attempt = 0;
      } catch (error) {
        if (this.received > before) attempt = 0;
        if (error instanceof LineError && error.again) {
          const seconds = Math.min(0.5 * 2 ** attempt++, 10);
          this.tell({ type: 'trouble', text: error.message, seconds });
          this.troubled = true;
          await this.change(1000 * seconds);
        } else {
          const known = error instanceof StreamError || error instanceof LineError;
          const memory = error instanceof RangeError && /alloc|length/i.test(error.message);
          const text = memory ? 'The mesh is too large for this device.' : known ? error.message : `The file is damaged: ${error.message}.`;
          this.tell({ type: 'failed', text });
          this.retry = false;
          while (!this.retry) await this.change();
          this.tell({ type: 'trouble', text: '' });
          if (!this.head) this.first = new Uint8Array(0);
        }
      }
    }
  }

  /** Try once more after a failure or a broken line. */
  again() {
    this.retry = true;
    for (const row of this.rows ?? []) if (row.bad) row.bad = row.have = 0;
    this.wake();
  }

  // -- bytes -------------------------------------------------------------------------------------------------------

  /** Read from the line; `take` gets each part and its place, and says whether to go on. */
  async fetch(begin, end, take) {
    const { budget } = this.wish;
    let stop = end;
    if (budget && this.line.ranges) stop = Math.min(end, begin + Math.max(1024, Math.floor(budget / 10)));
    if (budget) await this.pay(Math.min(stop - begin, budget / 10));
    const abort = (this.abort = new AbortController());
    let at = begin;
    try {
      for await (const part of this.line.read(begin, stop, abort.signal)) {
        this.count(part.length);
        const more = await take(part, at);
        at += part.length;
        if (!more) break;
        if (abort.signal.aborted && this.line.ranges) break;
        while (this.wish.paused && this.based) await this.change(); // without ranges the line is held, not left
        if (budget && !this.line.ranges) await this.pay(part.length);
      }
    } catch (error) {
      if (!abort.signal.aborted) throw error;
    } finally {
      this.abort = null;
    }
  }

  /** Wait until the budget allows so many bytes more. */
  async pay(bytes) {
    for (;;) {
      const { budget } = this.wish;
      const time = now();
      this.tokens = Math.min(this.tokens + ((time - (this.paid ?? time)) * budget) / 1000, Math.max(budget / 10, bytes));
      this.paid = time;
      if (!budget || this.tokens >= bytes) break;
      await this.change(Math.ceil(((bytes - this.tokens) * 1000) / budget));
    }
    this.tokens -= bytes;
  }

  count(bytes) {
    this.received += bytes;
    if (this.troubled) this.tell({ type: 'trouble', text: '' });
    this.troubled = false;
    const time = now();
    this.pace ??= { time, bytes: 0 };
    this.pace.bytes += bytes;
    const seconds = (time - this.pace.time) / 1000;
    if (seconds > 0.2) {
      const speed = this.pace.bytes / seconds;
      this.speed = this.speed ? (this.speed + speed) / 2 : speed;
      this.pace = { time, bytes: 0 };
    }
    this.progress();
  }

  async open() {
    await this.fetch(this.first.length, Math.max(FIRST, this.need ?? 0), async (part, at) => {
      if (this.head) {
        this.put(part, at);
        await this.decode();
        return true;
      }
      const grown = new Uint8Array(this.first.length + part.length);
      grown.set(this.first);
      grown.set(part, this.first.length);
      this.first = grown;
      if (grown.length < FIXED) return true;
      const sizes = readFixed(grown);
      this.need = FIXED + sizes.header + sizes.table;
      if (grown.length >= this.need && !this.line.ranges) await this.begin();
      return true;
    });
    if (this.head) return;
    if (this.first.length >= (this.need ?? FIXED)) await this.begin();
    else if (this.line.size && this.first.length >= this.line.size) throw new LineError('The file is cut short.', false);
  }

  async begin() {
    this.start(await readHead(this.first, readFixed(this.first)));
    this.put(this.first, 0);
    this.first = null;
    await this.decode();
  }

  start(head) {
    const { memory } = this.wish;
    const previous = head.meshes.map(() => null);
    let faces = head.meshes.reduce((sum, mesh) => sum + mesh.extra, 0);
    let bytes = 0;
    const rooms = head.meshes.map(() => ({ places: 0, faces: 0 }));
    for (const row of head.rows) {
      const before = previous[row.mesh];
      row.before = before;
      row.have = 0;
      faces += row.faces - (before?.faces ?? 0);
      row.total = faces;
      // positions, normals and what predicts them: about 60 bytes a place, 40 a face
      bytes += 60 * (row.places - (before?.places ?? 0)) + 40 * (row.faces - (before?.faces ?? 0));
      row.tooMuch = bytes > memory && before !== null;
      if (!row.tooMuch) rooms[row.mesh] = { places: row.places, faces: row.faces };
      previous[row.mesh] = row;
    }
    this.meshes = head.meshes.map((mesh, at) => new Mesh(mesh, rooms[at]));
    this.states = head.meshes.map(() => ({ row: null, next: null }));
    this.rows = head.rows;
    this.head = head;
    const base = head.rows[head.meshes.length - 1].total;
    if (this.wish.level < 1) this.wish.faces = Math.round(base * (faces / base) ** this.wish.level);
    this.tell({
      type: 'head', meta: head.header.meta ?? {}, rows: head.rows.map(({ total, error, mesh }) => ({ total, error, mesh })),
      faces, bytes: head.end, tooMuch: head.rows.some((row) => row.tooMuch),
      meshes: this.meshes.map((mesh, at) => ({
        extra: mesh.head.extra, wedges: mesh.wedgeParents.length, meta: mesh.head.meta ?? {}, room: rooms[at],
      })),
    });
  }

  /** Lay received bytes where they belong. */
  put(bytes, at) {
    for (const row of this.rows) {
      if (row.begin + row.length <= at || row.begin >= at + bytes.length || row.done) continue;
      const from = row.begin + row.have;
      if (from < at) continue;
      const part = bytes.subarray(from - at, row.begin + row.length - at);
      row.data ??= new Uint8Array(row.length);
      row.data.set(part, row.have);
      row.have += part.length;
    }
  }

  /** Whether a block shall be fetched. */
  wanted(row) {
    if (row.done || row.tooMuch) return false;
    if (!row.before) return true;
    const { error, faces, views, paused } = this.wish;
    if (paused) return false;
    const view = views[row.mesh] ?? { visible: true, scale: 0 };
    const before = row.before;
    if (!view.visible || before.total >= faces) return false;
    if (!error) return true;
    return view.scale > 0 && !(before.error > 0 && before.error * view.scale <= error);
  }

  /** Fetch what is wanted next; false where nothing is. */
  async next() {
    await this.decode();
    const first = this.rows.findIndex((row) => this.wanted(row));
    if (first < 0) return false;
    let last = first;
    while (last + 1 < this.rows.length && this.wanted(this.rows[last + 1])) last++;
    const begin = this.rows[first].begin + this.rows[first].have;
    const end = this.rows[last].begin + this.rows[last].length;
    if (this.line.size && this.line.size <= begin) throw new LineError('The file is cut short.', false);
    await this.fetch(begin, this.line.ranges ? end : Infinity, async (part, at) => {
      this.put(part, at);
      await this.decode();
      const row = this.rows.find((one) => !one.done && one.begin + one.length > at + part.length);
      return !this.line.ranges || !row || this.wanted(row);
    });
    if (this.rows[first].have < this.rows[first].length && this.line.size && this.line.size < end) {
      const got = this.rows[first].begin + this.rows[first].have;
      if (got >= this.line.size) throw new LineError('The file is cut short. What came is shown.', false);
    }
    return true;
  }

  // -- splits ------------------------------------------------------------------------------------------------------

  async decode() {
    for (const row of this.rows) {
      if (row.done || row.have < row.length || (row.before && !row.before.done) || row.tooMuch) continue;
      if (crc32(row.data) !== row.crc) return this.spoiled(row);
      const mesh = this.meshes[row.mesh];
      const state = this.states[row.mesh];
      const time = now();
      const places = mesh.places;
      try {
        if (row.before) await mesh.batch(row.data, row.places, row.faces);
        else await mesh.base(row.data, row.places, row.faces);
      } catch (error) {
        for (const other of this.rows) if (other.mesh === row.mesh && !other.done) other.tooMuch = true;
        throw error;
      }
      this.busy += now() - time;
      this.splits += row.before ? mesh.places - places : 0;
      this.decoded += row.length;
      row.done = true;
      row.data = null;
      state.row = row;
      if (now() - (this.breathed ?? 0) < 12) continue;
      this.present();
      await breath();
      this.breathed = now();
    }
    this.present();
    this.progress(true);
    if (this.rows.every((row) => row.done) && !this.checked) await this.check();
  }

  /** A block whose checksum is wrong is asked for once more, in case the line did it. */
  spoiled(row) {
    row.data = null;
    row.have = 0;
    row.bad = (row.bad ?? 0) + 1;
    if (row.bad < 2) return;
    const at = this.rows.indexOf(row);
    throw new StreamError(`The file is damaged at block ${at} of ${this.rows.length}. What came before it is shown.`);
  }

  async check() {
    this.checked = true;
    let identical = true;
    for (const mesh of this.meshes) identical &&= (await digest(mesh)) === mesh.head.hash;
    this.tell({ type: 'whole', identical, quantised: this.meshes.some((mesh) => mesh.head.bits), time: now() - this.begun });
  }

  // -- pictures ----------------------------------------------------------------------------------------------------

  /** The triangles of all meshes as far as they are decoded. */
  there() {
    return this.meshes.reduce((sum, mesh) => sum + (mesh.places ? mesh.head.extra + mesh.faceCount : 0), 0);
  }

  /** The triangles that may be shown now: wanted, there, and on a slow line spread until more comes. */
  target() {
    const there = this.there();
    const open = this.rows.find((row) => !row.done);
    const { faces, cap, paused } = this.wish;
    const limit = Math.min(faces, cap);
    const wait = open && !paused && this.speed && this.wanted(open) ? (1000 * (open.length - open.have)) / this.speed : 0;
    if (wait > 1.4 * STEP && this.shown && there > this.shown && limit > this.shown) {
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.present(true), STEP);
      if (!this.due) return this.shown;
      return Math.min(limit, this.shown + Math.ceil((there - this.shown) * Math.min(1, (1.5 * STEP) / wait)));
    }
    return limit;
  }

  /** Post the level to show, unless the page is still busy with the one before. */
  present(due = false) {
    if (!this.head) return;
    this.due ||= due;
    if (!this.pictured && !this.mayBegin()) return;
    if (this.drawing) {
      this.pending = true;
      return;
    }
    const open = this.rows.find((row) => !row.done && this.wanted(row));
    const pause = this.there() < 4 * this.shown ? LONG : QUIET; // all of them together cost little more than the last
    const left = (this.posted ?? -LONG) + pause - now();
    if (open && left > 0 && !this.hurry) {
      this.quiet ??= setTimeout(() => {
        this.quiet = undefined;
        this.present();
      }, left);
      return;
    }
    this.hurry = false;
    const target = this.target();
    this.due = false;
    const places = this.placesFor(target);
    if (places.every((count, at) => count === this.levels[at])) return;
    const changes = [];
    places.forEach((count, at) => {
      if (count !== this.levels[at]) changes.push({ mesh: at, places: count });
    });
    this.levels = places;
    this.shown = this.meshes.reduce((sum, mesh, at) => sum + mesh.head.extra + (mesh.facesAfter[places[at] - 1] ?? 0), 0);
    this.drawing = true;
    this.posted = now();
    const first = !this.pictured;
    this.pictured = true;
    this.tell({ type: 'level', changes, shown: this.shown, first, used: this.used(), time: now() - this.begun });
    this.progress(true);
  }

  /** The first picture waits for all of the first bytes, but not for long. */
  mayBegin() {
    if (!this.rows.every((row) => row.before || row.done)) return false;
    const last = this.rows.findLast((row) => row.begin + row.length <= FIRST);
    this.based ??= now();
    if (!last || last.done || now() - this.based > PATIENCE) return true;
    this.timer ??= setTimeout(() => this.present(), PATIENCE);
    return false;
  }

  /** Bytes of the file that went into what is there. */
  used() {
    return this.rows[0].begin + this.rows.reduce((sum, row) => sum + (row.done ? row.length : 0), 0);
  }

  /** The page has drawn. */
  drawn() {
    this.drawing = false;
    if (this.pending) {
      this.pending = false;
      this.present();
    }
  }

  /** Places of each mesh in the level with so many triangles. */
  placesFor(target) {
    const places = this.meshes.map(() => 0);
    for (const row of this.rows) {
      if (!row.done) continue;
      const start = row.total - (row.faces - (row.before?.faces ?? 0));
      if (row.total <= target || !row.before) places[row.mesh] = row.places;
      else if (start < target) places[row.mesh] = lastWithin(this.meshes[row.mesh].facesAfter, row, row.faces - row.total + target);
    }
    return places;
  }

  progress(force) {
    const time = now();
    if (!force && time - (this.told ?? 0) < 60) return;
    this.told = time;
    const rows = this.rows ?? [];
    const there = this.head ? this.there() : 0;
    const errors = (this.states ?? []).map((state) => this.errorOf(state));
    this.tell({
      type: 'progress', received: this.received, there, shown: this.shown, errors, ranges: this.line.ranges,
      splits: this.splits, rate: this.busy ? (1000 * this.splits) / this.busy : 0,
      waiting: rows.length > 0 && rows.some((row) => !row.done) && !rows.some((row) => this.wanted(row)),
    });
  }

  /** The estimated deviation of a mesh as it is shown; -1 where unknown. */
  errorOf(state) {
    const at = this.states.indexOf(state);
    const places = this.levels[at] ?? 0;
    let found = null;
    for (const row of this.rows) if (row.mesh === at && row.places <= places) found = row;
    if (!found) return -1;
    const last = this.rows.findLast((row) => row.mesh === at);
    return found === last ? 0 : found.error || -1;
  }
}

/** Places of the finest level of a batch with at most so many faces of its mesh. */
function lastWithin(facesAfter, row, faces) {
  let low = row.before.places;
  let high = row.places;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (facesAfter[middle - 1] <= faces) low = middle;
    else high = middle - 1;
  }
  return low;
}
