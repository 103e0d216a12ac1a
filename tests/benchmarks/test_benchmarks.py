# SPDX-License-Identifier: GPL-3.0-or-later
"""A small benchmark from end to end: exact counts and quality, never times."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from benchmarks import runner, shapes
from benchmarks.__main__ import main
from benchmarks.ablation import BASE, VARIANTS, means, run_ablation
from benchmarks.meter import CLEAR_REFS, Meter
from benchmarks.peers import PEERS, Peer
from benchmarks.report import read, write
from benchmarks.runner import Plan, run
from benchmarks.summary import Rows, ratios, summarise
from benchmarks.worker import Worker

TINY = 3000
# meshoptimizer comes by network, and a test must not need one.
INSTALLED = [peer for peer in PEERS.values() if peer.needs != "node" and not peer.missing()]


@pytest.fixture(scope="module")
def rows() -> Rows:
    said: list[str] = []
    kept: list[int] = []
    plan = Plan({"tiny": partial(shapes.scan, TINY)}, (0.2, 0.05), INSTALLED, repeat=1, timeout=120.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "SAMPLES", 2000)
        found = run(plan, said.append, lambda so_far: kept.append(len(so_far)))
    assert [line for line in said if "failed" in line] == []
    assert kept == [len(found) // 2, len(found)]  # 5 % first
    return found


def of(rows: Rows, peer: str) -> Rows:
    return [row for row in rows if row["peer"] == peer]


def test_every_peer_has_every_case(rows: Rows) -> None:
    assert {row["peer"] for row in rows} == {peer.name for peer in INSTALLED}
    assert all(len(of(rows, peer.name)) == 2 for peer in INSTALLED)


def test_triangle_counts_are_reached(rows: Rows) -> None:
    for row in rows:
        slack = 1 if PEERS[row["peer"]].ours else max(3, 0.02 * row["target"])
        assert abs(row["faces"] - row["target"]) <= slack, row


def test_deviations_are_in_order(rows: Rows) -> None:
    for row in rows:
        assert 0 < row["mean"] <= row["rms"] <= row["maximum"] < 0.1, row
        assert 0 < row["normal"] < 60
        assert row["seconds"] > 0
    for peer in INSTALLED:
        coarse, fine = sorted(of(rows, peer.name), key=lambda row: row["ratio"])
        assert coarse["mean"] > fine["mean"]


def test_ours_is_as_close_as_the_peers(rows: Rows) -> None:
    foreign = [peer.name for peer in INSTALLED if not peer.ours]
    if not foreign:
        pytest.skip("no peer is installed")
    found = ratios(rows, "default", foreign, "mean")
    assert len(found) == 2
    assert max(found.values()) < 1.25


def test_optimal_placement_is_closer_than_endpoints(rows: Rows) -> None:
    assert max(ratios(rows, "qem", ["qem end"], "mean").values()) < 1


def test_the_report_is_written_and_read_back(rows: Rows, tmp_path: Path) -> None:
    write(tmp_path, rows, {"somebody": "is not installed"})
    text = (tmp_path / "bench.md").read_text()
    assert "Left out: somebody (is not installed)." in text
    assert all(f"| {peer.name} |" in text for peer in INSTALLED)
    again, skipped = read(tmp_path / "bench.json")
    assert again == rows
    assert skipped == {"somebody": "is not installed"}


def test_plots_are_drawn(rows: Rows, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    write(tmp_path, rows, {})
    for name in ("deviation", "time", "speed-error"):
        assert (tmp_path / f"{name}.png").stat().st_size > 1000
        assert (tmp_path / f"{name}.svg").stat().st_size > 1000


def made_up(peer: str, mesh: str, **changes: float) -> dict[str, object]:
    """Return a row of ones, but for the changes."""
    ones = dict.fromkeys(("seconds", "bytes_per_triangle", "maximum", "mean", "rms", "normal"), 1.0)
    whole = {"triangles": 100_000, "ratio": 0.05, "faces": 5000, "target": 5000, "runs": [1.0]}
    return {"mesh": mesh, "peer": peer, **whole, **ones, **changes}


def test_the_summary_takes_the_best_peer_of_each_case() -> None:
    rows = [
        made_up("default", "a", mean=0.5),
        made_up("decimate", "a"),
        made_up("vtk", "a", mean=0.8),
        made_up("pyfqmr scaled", "a", mean=0.25),
        made_up("default", "b", mean=2.0),
        made_up("decimate", "b", mean=4.0),
    ]
    figures = {figure.name: figure for figure in summarise(rows)}
    called = figures["default, mean deviation over the best peer of each case (as called)"]
    assert called.value == pytest.approx(((0.5 / 0.8) * 0.5) ** 0.5)
    assert (called.mark, called.cases) == ("pass", 2)
    scaled = figures["default, mean deviation over the best peer of each case (scaled ones too)"]
    assert scaled.value == pytest.approx(1.0)
    assert scaled.mark == "miss"
    assert figures["`qem` over Decimate, time at 5 %"].mark == "not measured"


def test_times_count_from_fifty_thousand_triangles_and_at_five_percent() -> None:
    rows = [
        made_up(peer, mesh, ratio=ratio, triangles=triangles, seconds=seconds if peer == "qem" else 1.0)
        for peer in ("qem", "decimate")
        for mesh, ratio, triangles, seconds in (
            ("large", 0.05, 60_000, 0.2),
            ("small", 0.05, 40_000, 9.0),
            ("large", 0.01, 60_000, 9.0),
        )
    ]
    figure = next(figure for figure in summarise(rows) if figure.name == "`qem` over Decimate, time at 5 %")
    assert figure.value == pytest.approx(0.2)
    assert figure.cases == 1


def test_the_ablation_compares_with_the_default() -> None:
    case = {"mesh": "a", "ratio": 0.05, "maximum": 1.0, "normal": 1.0, "seconds": 1.0}
    found = means([{**case, "variant": BASE, "mean": 2.0}, {**case, "variant": "refit off", "mean": 3.0}])
    assert found["refit off"]["mean"] == pytest.approx(1.5)
    assert found[BASE] == pytest.approx(dict.fromkeys(("maximum", "mean", "normal", "seconds"), 1.0))


def test_the_ablation_names_what_fails_and_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "SAMPLES", 500)
    for variant in list(VARIANTS):
        if variant != BASE:
            monkeypatch.delitem(VARIANTS, variant)
    monkeypatch.setitem(VARIANTS, "odd", {"method": "no such method"})
    monkeypatch.setitem(VARIANTS, "even", {"method": "qem"})
    said: list[str] = []
    rows = run_ablation(Plan({"tiny": partial(shapes.scan, 300)}, (0.5,), [], repeat=2), said.append)
    assert [row["variant"] for row in rows] == [BASE, "even"]
    assert sum("odd failed" in line for line in said) == 1


def test_a_peer_that_fails_is_named_and_left_out(tmp_path: Path) -> None:
    broken = Peer("qem", PEERS["qem"].adapter, "eso_addon", ours=True, options={"method": "no such method"})
    said: list[str] = []
    plan = Plan({"tiny": partial(shapes.scan, 300)}, (0.2,), [broken], repeat=2)
    assert run(plan, said.append, lambda _: None) == []
    assert sum("qem failed at" in line for line in said) == 1


def test_every_mesh_is_run_at_five_percent_before_any_at_another_ratio() -> None:
    made = dict.fromkeys(("one", "grid", "two"), partial(shapes.scan, 300))
    plan = Plan(made, (0.2, 0.05, 0.01), [])
    assert plan.rounds() == [("one", [0.05]), ("grid", [0.05]), ("two", [0.05]), ("one", [0.2, 0.01]),
                             ("two", [0.2, 0.01])]


def test_nothing_is_begun_when_the_time_is_up() -> None:
    said: list[str] = []
    plan = Plan({"tiny": partial(shapes.scan, 300)}, (0.2, 0.05), [PEERS["qem"]], minutes=1e-12)
    assert run(plan, said.append, lambda _: None) == []
    assert run_ablation(plan, said.append) == []
    assert sum("time is up" in line for line in said) == 3


def test_a_peer_that_takes_too_long_is_ended(tmp_path: Path) -> None:
    mesh = tmp_path / "mesh.npz"
    vertices, faces = shapes.scan(300)
    np.savez(mesh, vertices=vertices, faces=faces)
    with Worker(PEERS["qem"], mesh, timeout=0.001) as worker:
        assert "no answer after" in worker.ask(100)["error"]
        assert "ended" in worker.ask(100)["error"]


@pytest.mark.skipif(not CLEAR_REFS.exists(), reason="needs the peak memory that Linux keeps")
def test_the_meter_sees_memory_that_is_given_back() -> None:
    with Meter() as meter:
        held = np.ones(4_000_000)
        del held
    assert 30e6 < meter.peak < 60e6


def test_wrong_words_are_a_clear_error(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["--meshes", "nothing"], ["--peers", "nobody"], ["--models", "/no/such/folder"], ["--ratios", "x"]):
        with pytest.raises(SystemExit) as ended:
            main(words)
        assert ended.value.code == 2
        assert "Traceback" not in capsys.readouterr().err


def test_the_command_writes_its_report(tmp_path: Path, rows: Rows) -> None:
    write(tmp_path / "one", rows, {})
    assert main(["--from", str(tmp_path / "one" / "bench.json"), "--out", str(tmp_path / "two")]) == 0
    one, two = (json.loads((tmp_path / name / "bench.json").read_text()) for name in ("one", "two"))
    assert one["rows"] == two["rows"]
