"""Pages of modes: what is in them, and what they refuse. That browsers show them is tested with the program."""
import base64
import json
import re
import zlib

import numpy as np
import pytest
from test_solve import chain

import kschur
from kschur.errors import Error, InputError
from kschur.page import STEPS, View


@pytest.fixture
def three(tmp_path, monkeypatch):
    place = tmp_path / "three.min.js"
    place.write_text("/* three */")
    monkeypatch.setenv("KSCHUR_THREE", str(place))
    return place


def solved():
    return kschur.solve(*chain(12), modes=3, geometry=kschur.Geometry(np.arange(4.0)[:, None]))


def whole_numbers(page, name):
    packed = zlib.decompress(base64.b64decode(re.search(f'id="{name}">([^<]*)<', page).group(1)))
    return np.cumsum(np.frombuffer(packed, np.uint8).reshape(2, -1).T.copy().view("<i2").ravel(), dtype=np.int16)


def test_facts_and_shapes(three, tmp_path):
    result = solved()
    result.view([2, 0]).save(tmp_path / "modes.html")
    page = (tmp_path / "modes.html").read_text()
    facts = json.loads(re.search(r'id="facts">(.*?)</script>', page).group(1))
    assert [mode["number"] for mode in facts["modes"]] == [3, 1]
    assert [mode["frequency"] for mode in facts["modes"]] == [result.frequency_hz[2], result.frequency_hz[0]]
    assert np.allclose(facts["mac"], np.eye(2), atol=1e-4)
    moved = result.geometry.displacements(result.shape(2)).real
    moved /= np.sqrt((moved**2).sum(axis=1).max())
    assert abs(whole_numbers(page, "mode-0-re").reshape(3, -1).T / STEPS - moved).max() <= 0.5 / STEPS + 1e-12
    assert "@" + "DATA@" not in page and "/* three */" in page and page in View(result, [2, 0]).html
    assert result.view()._repr_html_().startswith("<iframe srcdoc=")


def test_refusals(three):
    with pytest.raises(InputError, match="geometry"):
        kschur.solve(*chain(12), modes=1).view()
    three.unlink()
    with pytest.raises(Error, match="libjs-three"):
        solved().view()
