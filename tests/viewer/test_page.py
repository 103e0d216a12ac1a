# SPDX-License-Identifier: GPL-3.0-or-later
"""A page that holds a stream: whole, one file, and asks for nothing else."""

import base64
import json
import re
from pathlib import Path

import pytest

from eso_addon.viewer.client_files import CLIENT
from eso_addon.viewer.page import bundle, write_page


def test_it_holds_all_that_it_needs(torus: Path, tmp_path: Path) -> None:
    size = write_page(torus, tmp_path / "torus.html")
    text = (tmp_path / "torus.html").read_text(encoding="utf-8")
    assert size == (tmp_path / "torus.html").stat().st_size
    mesh = re.search(r'id="mesh">([^<]*)</script>', text)
    assert mesh
    assert base64.b64decode(mesh[1]) == torus.read_bytes()
    assert "Permission is hereby granted" in text
    assert "<title>torus</title>" in text


def test_titles_are_text(torus: Path, tmp_path: Path) -> None:
    write_page(torus, tmp_path / "a.html", title='<b>"Ünï" & {x}')
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "<title>&lt;b&gt;&quot;Ünï&quot; &amp; {x}</title>" in text


@pytest.mark.parametrize("entry", ["worker.js", "viewer.js"])
def test_bundles_have_no_imports_left(entry: str) -> None:
    text = bundle(entry)
    assert not re.search(r"^(import|export) ", text, flags=re.MULTILINE)
    assert "</script" not in text
    assert "panel.html'" not in text
    assert text.index("modules['container.js'] =" if entry == "worker.js" else "modules['panel.js'] =") > 0


def test_the_page_holds_its_style(torus: Path, tmp_path: Path) -> None:
    write_page(torus, tmp_path / "torus.html")
    text = (tmp_path / "torus.html").read_text(encoding="utf-8")
    assert json.dumps((CLIENT / "panel.html").read_text(encoding="utf-8")) in text
    assert "<link" not in text


def test_what_is_no_stream_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.esopm").write_bytes(b"solid")
    with pytest.raises(ValueError, match="not an .esopm file"):
        write_page(tmp_path / "a.esopm", tmp_path / "a.html")
    assert not (tmp_path / "a.html").exists()
