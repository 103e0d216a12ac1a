# SPDX-License-Identifier: GPL-3.0-or-later
"""The line's budget and the pictures' pace, by a clock that stands while the page works."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

from .sites import Site

# Loads the mesh over a line with these delays, one for each request, in turns; a picture is drawn in 60 ms. Gives what
# came, as [time, bytes], and the pictures as [time, triangles]. Time goes on, from timer to timer, when nothing else is
# left to do.
LOAD = """async ({ budget, delays }) => {
  const bytes = new Uint8Array(await (await fetch('/mesh.esopm')).arrayBuffer());
  const { makeStream } = await import('/stream.js');
  const { port1, port2 } = new MessageChannel();
  const turn = () => new Promise((resolve) => { port1.onmessage = resolve; port2.postMessage(0); });
  let time = 0;
  let unpacking = 0;
  let number = 0;
  const timers = new Map();
  performance.now = () => time;
  globalThis.setTimeout = (act, wait = 0) => (timers.set(++number, [time + Math.max(wait, 0), act]), number);
  globalThis.clearTimeout = (one) => timers.delete(one);
  for (const owner of [Response.prototype, SubtleCrypto.prototype]) {
    const name = owner === Response.prototype ? 'arrayBuffer' : 'digest';
    const before = owner[name];
    owner[name] = function (...words) {
      unpacking++;
      return before.apply(this, words).finally(() => unpacking--);
    };
  }
  const sleep = (wait) => new Promise((resolve) => setTimeout(resolve, wait));
  const came = [];
  const pictures = [];
  let done;
  let shown = 0;
  const line = {
    ranges: true, size: bytes.length,
    async* read(begin, end) {
      await sleep(delays[came.length % delays.length]);
      came.push([time, Math.min(end, bytes.length) - begin]);
      yield bytes.subarray(begin, end);
    },
  };
  const stream = makeStream(line, { budget, level: 1, cap: Infinity, memory: Infinity }, async () => {
    await sleep(60);
    pictures.push([time, shown]);
    stream.drawn();
  }, (message) => {
    if (message.type !== 'state') return;
    shown = message.shown;
    done = message.identical && message.shown === message.there;
  });
  while (!done || !timers.size) {
    for (let turns = 0; turns < 8; turns = unpacking ? 0 : turns + 1) await turn();
    if (!timers.size) break;
    const [first] = [...timers].sort((a, b) => a[1][0] - b[1][0] || a[0] - b[0]);
    timers.delete(first[0]);
    time = Math.max(time, first[1][0]);
    first[1][1]();
  }
  return { came, pictures, bytes: bytes.length };
}"""


@pytest.mark.parametrize(("budget", "delays"), [
    (6000, [0]), (6000, [3]), (6000, [130]), (2500, [5, 5, 120, 5, 20]), (9000, [4, 300, 90, 2]), (900, [10])])
def test_no_second_has_more_than_its_bytes_and_pictures_go_on(
        page: Any, site: Callable[..., Site], budget: int, delays: list[int]) -> None:  # noqa: ANN401
    page.goto(f"{site().url}three.LICENSE")
    found = page.evaluate(LOAD, {"budget": budget, "delays": delays})
    came, pictures = found["came"], found["pictures"]
    assert sum(count for _, count in came) == found["bytes"]
    for end, _ in came:
        assert sum(count for time, count in came if end - 1000 < time <= end) <= budget
    assert pictures[-1][1] == 5000
    assert all(before[1] < after[1] for before, after in pairwise(pictures))
    assert all(after[0] - before[0] <= 500 for before, after in pairwise(pictures))
