"""Pages of modes: what is in them, and what they refuse. That browsers show them is tested with the program."""
import base64
import json
import re
import zlib

import numpy as np
import pytest
from test_solve import chain

import kschur
from kschur.errors import Error, InputError, UsageError
from kschur.pages.modes import ModesPage
from kschur.pages.response import _shaped
from kschur.pages.space import COARSE, STEPS, coarser
from kschur.response import Response


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
    assert "@" + "DATA@" not in page and "/* three */" in page and page in ModesPage(result, [2, 0]).html
    assert result.view()._repr_html_().startswith("<iframe srcdoc=")


def test_energies_and_constraints(three):
    mass, stiffness, *_ = chain(12)
    result = solved()
    ties = np.zeros((3, 12))
    ties[0, 0] = ties[1, 4] = 1.0
    ties[1, 10], ties[2, 6], ties[2, 7] = -1.0, 1.0, 2.0
    page = result.view(stiffness=stiffness, constraints=ties).html
    facts = json.loads(re.search(r'id="facts">(.*?)</script>', page).group(1))
    wanted = [np.vdot(phi, stiffness @ phi).real / 4 for phi in result.shapes.T]
    assert np.allclose([mode["energy"] for mode in facts["modes"]], wanted, rtol=1e-10)
    each = (result.shapes[:, 1].conj() * (stiffness @ result.shapes[:, 1])).real.reshape(4, 3).sum(axis=1).clip(0)
    assert abs(whole_numbers(page, "mode-1-energy") / STEPS - each / each.max()).max() <= 0.5 / STEPS + 1e-12
    packed = {name: zlib.decompress(base64.b64decode(re.search(f'id="model-0-{name}">([^<]*)<', page).group(1))) for name in ("ties", "marks")}
    found = {name: np.cumsum(np.frombuffer(part, np.uint8).reshape(4, -1).T.copy().view("<i4").ravel()).tolist() for name, part in packed.items()}
    assert found == {"ties": [1, 3], "marks": [0, 2]}
    assert "mode-0-energy" not in result.view().html and "model-0-ties" not in result.view().html
    with pytest.raises(InputError, match="must be 12 x 12"):
        result.view(stiffness=np.eye(3))
    with pytest.raises(InputError, match="must be 1 x 12"):
        result.view(constraints=np.ones((1, 5)))


def test_refusals(three):
    with pytest.raises(InputError, match="geometry"):
        kschur.solve(*chain(12), modes=1).view()
    with pytest.raises(InputError, match="no modes"):
        kschur.solve(*chain(12), band=(10, 20), geometry=kschur.Geometry(np.arange(4.0)[:, None])).view()
    with pytest.raises(InputError, match="no modes"):
        solved().view([])
    three.unlink()
    with pytest.raises(Error, match="libjs-three"):
        solved().view()


def facts_of(page):
    return json.loads(re.search(r'id="facts">(.*?)</script>', page.html).group(1))


def floating_numbers(page, name):
    packed = zlib.decompress(base64.b64decode(re.search(f'id="{name}">([^<]*)<', page.html).group(1)))
    return np.frombuffer(packed, np.uint8).reshape(4, -1).T.copy().view("<f4").ravel()


def test_nodes_are_sorted_in_space(three):
    """However they are numbered: the page is as small as that of nodes row by row, and the shapes are those of the nodes."""
    columns, rows = 60, 50
    y, x = np.mgrid[:rows, :columns].reshape(2, -1)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    quads = np.column_stack([corner, corner + 1, corner + columns + 1, corner + columns])
    order = np.random.default_rng(3).permutation(columns * rows)
    number = np.argsort(order)
    shape = np.sin(2 * np.pi * x / columns) * np.cos(3 * np.pi * y / rows)
    pages = []
    for nodes, cells, moved in ((np.column_stack([x, y, 0 * x]), quads, shape), (np.column_stack([x, y, 0 * x])[order], number[quads], shape[order])):
        geometry = kschur.Geometry(nodes, cells={"quad": cells})
        response = Response(np.array([1.0]), moved[None].astype(complex), np.zeros((1, 0)))
        pages.append(response.view([0], geometry))
    assert abs(len(pages[0].html) - len(pages[1].html)) < 0.02 * len(pages[0].html)
    place = floating_numbers(pages[1], "model-0-coordinates").reshape(-1, 3)
    read = whole_numbers(pages[1].html, "mode-0-re").reshape(3, -1)[2] / STEPS
    wanted = np.sin(2 * np.pi * place[:, 0] / columns) * np.cos(3 * np.pi * place[:, 1] / rows)
    assert sorted(map(tuple, place[:, :2])) == sorted(zip(x, y)) and abs(read - wanted / abs(shape).max()).max() < 1 / STEPS


def test_what_is_within_a_solid_is_left_out(three):
    n = 5
    z, y, x = np.mgrid[:n, :n, :n].reshape(3, -1)
    corner = (np.arange(n - 1)[:, None, None] * n * n + np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    cells = corner[:, None] + [0, 1, 1 + n, n, n * n, n * n + 1, n * n + n + 1, n * n + n]
    response = Response(np.array([1.0]), np.ones((1, 3 * n**3), complex), np.zeros((1, 0)))
    page = response.view([0], kschur.Geometry(np.column_stack([x, y, z]), cells={"hexahedron": cells}))
    assert len(floating_numbers(page, "model-0-coordinates")) == 3 * (n**3 - (n - 2)**3)


def test_sweep(three, tmp_path):
    geometry = kschur.Geometry(np.arange(4.0)[:, None])
    M, K = chain(12)
    swept = kschur.sweep(lambda p: (M, p * K), [60, 120, 240], modes=2, geometry=geometry, parameter="speed", unit="rpm")
    page = swept.view(orders=[2])
    facts = facts_of(page)
    assert facts["parameter"] == "speed (rpm)" and np.allclose(facts["orders"][0]["slope"], 2 / 60)
    assert np.allclose(np.array([branch["hertz"] for branch in facts["branches"]]).T, swept.frequency_hz, rtol=1e-8)
    assert sorted(number for branch in facts["shapes"] for number in branch) == list(range(6))
    place = floating_numbers(page, "model-0-coordinates").reshape(-1, 3)[:, 0].astype(int)
    for branch in range(2):
        wanted = np.sin((branch + 1) * np.pi * np.arange(1, 13) / 13).reshape(4, 3)[place]
        read = whole_numbers(page.html, f"mode-{facts['shapes'][branch][2]}-re").reshape(3, -1).T / STEPS
        assert abs(abs((read * wanted).sum()) / np.linalg.norm(read) / np.linalg.norm(wanted) - 1) < 1e-5
    assert [None if number is None else "there" for number in facts_of(swept.view(points=[1]))["shapes"][0]] == [None, "there", None]
    swept.save(tmp_path / "s.h5")
    assert kschur.load(tmp_path / "s.h5").view(orders=[2]).html == page.html
    plain = kschur.sweep(lambda p: (M, p * K), [60, 120], modes=2)
    three.unlink()
    plain.view().save(tmp_path / "sweep.html")
    assert "model-0-coordinates" not in (tmp_path / "sweep.html").read_text()
    with pytest.raises(UsageError, match="unit"):
        plain.view(orders=[1])


def test_points_of_a_sweep_have_their_own_models(three, tmp_path):
    """Points of the same nodes share one."""
    M, K = chain(12)
    swept = kschur.sweep(lambda p: (M, p * K), [60, 120, 240], modes=2,
                         geometry=lambda p: kschur.Geometry(np.arange(4.0)[:, None] * max(p / 120, 1)))
    page = swept.view()
    facts = facts_of(page)
    assert facts["models"] == [0, 0, 1] and facts["box"] == [[0, 0, 0], [6, 0, 0]]
    assert [floating_numbers(page, f"model-{k}-coordinates").max() for k in (0, 1)] == [3, 6]
    swept.save(tmp_path / "s.h5")
    assert kschur.load(tmp_path / "s.h5").view().html == page.html


def test_coarse_surfaces_cover_what_they_stand_for():
    columns, rows = 250, 200
    y, x = np.mgrid[:rows, :columns].reshape(2, -1)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    triangles = np.vstack([np.column_stack([corner, corner + 1, corner + columns]), np.column_stack([corner + 1, corner + columns + 1, corner + columns])])
    places = np.column_stack([x, y, 0.2 * y]).astype(float)
    coarse = coarser(triangles, places)
    assert COARSE / 3 < len(coarse) < 1.5 * COARSE and len(coarser(triangles[:COARSE], places)) == 0

    def area(rows):
        a, b, c = places[rows].transpose(1, 0, 2)
        return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert abs(area(coarse) / area(triangles) - 1) < 0.03
    assert np.ptp(places[np.unique(coarse)], axis=0).tolist() == np.ptp(places, axis=0).tolist()


def test_response(three):
    M, K = chain(12)
    response = kschur.frequency_response(M, K, 0.1 * M, frequencies=np.linspace(0.01, 0.3, 9), forces=np.eye(12)[0])
    page = response.view([0, 11], kschur.Geometry(np.arange(4.0)[:, None]))
    facts = facts_of(page)
    assert [unknown["name"] for unknown in facts["unknowns"]] == ["unknown 1: node 1, x", "unknown 12: node 4, z"]
    assert np.allclose(facts["unknowns"][1]["im"], response.displacement[:, 11].imag, rtol=1e-8)
    assert [shape["number"] for shape in facts["shapes"]] == list(range(9))
    most = np.sqrt((abs(response.displacement.reshape(9, 4, 3))**2).sum(axis=2).max(axis=1))
    assert np.allclose([shape["largest"] for shape in facts["shapes"]], most)
    with pytest.raises(InputError, match="12 unknowns"):
        response.view(0, kschur.Geometry(np.arange(5.0)[:, None]))


def test_the_shapes_of_peaks_are_kept():
    size = np.array([1, 2, 1, 1, 5, 1, 1, 1, 3, 1.0])
    assert _shaped(size[:, None], 2) == [4, 8] and set(_shaped(size[:, None], 5)) > {1, 4, 8} and len(_shaped(size[:, None], 99)) == 10
