"""Pages of kschur view --html, in a headless Chromium: test_page.py KSCHUR [--pictures FOLDER] [--rates].

It clicks, turns and plays, and compares what the page says with the file. With --pictures the pictures of docs are kept, with --rates
frames are counted with 10,000, 100,000 and 200,000 nodes, by hand.
"""
import importlib
import os
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import scipy.sparse as sparse
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By

from browser import KSCHUR, check_console, click, coloured, differ, kschur, load, open_browser, pictures_folder, pixels, wait_for, wait_frames
from checks import check, run_tests

PICTURES = pictures_folder()


def page_of(folder, name, scene, *options):
    kschur("scene", *scene.split(), "--output", folder/f"{name}.h5")
    kschur("solve", folder/f"{name}.h5", *options, "--output", folder/f"{name}_modes.h5")
    kschur("view", folder/f"{name}_modes.h5", "--html", folder/f"{name}.html")
    return folder/f"{name}.html"


def test_a_page(folder):
    browser = open_browser()
    try:
        load(browser, page_of(folder, "grid", "grid", "--modes", 12, "--properties"))
        with h5py.File(folder/"grid_modes.h5") as file:
            frequencies, shapes = file["frequency_hz"][:], file["eigenvectors"][:]
            node, component, coordinates = (file[name][:] for name in ("unknown_node", "unknown_component", "coordinates"))
        rows = browser.find_elements(By.CSS_SELECTOR, "#list tbody tr")
        check("a row for each mode", len(rows) == 12)
        check("frequencies are those of the file", np.allclose([float(row.get_attribute("data-frequency")) for row in rows], frequencies, rtol=1e-14, atol=0))
        shown = [float(row.find_elements(By.TAG_NAME, "td")[2].text) for row in rows]
        check("and so they read", np.allclose(shown, frequencies, rtol=1e-2, atol=0), shown)
        check("effective masses are listed", "mass z %" in browser.find_element(By.CSS_SELECTOR, "#list thead").text)
        click(browser, "play")
        browser.execute_script("kschur.state.phase = 0")
        rows[7].click()
        wait_for(browser, "return kschur.state.chosen.join() == '7'")
        moved = np.zeros((node.max() + 1, 3), complex)
        moved[node[component < 3], component[component < 3]] = shapes[7][component < 3]
        moved /= np.sqrt((abs(moved)**2).sum(1).max())
        read, places = (np.array(browser.execute_async_script(f"const done = arguments[0]; {numbers}.then(x => done(Array.from(x)))")).reshape(-1, 3)
                        for numbers in ("displacements('mode-7-re')", "floatingNumbers('model-0-coordinates')"))
        page, wanted = (np.lexsort(np.float32(points).T) for points in (places, coordinates))
        check("nodes are those of the file", np.array_equal(np.float32(places)[page], np.float32(coordinates)[wanted]))
        check("the shape is that of the file", abs(read[page] / 32767 - moved.real[wanted]).max() < 5e-4)
        wait_frames(browser)
        still = pixels(browser)
        check("something is drawn, and fills the stage", coloured(still) > 0.004 and still.shape[0] > 500 and still.shape[1] > 700, (coloured(still), still.shape))
        wait_frames(browser)
        check("what does not play does not move", differ(still, pixels(browser)) == 0)
        browser.execute_script("kschur.state.phase = Math.PI")
        wait_frames(browser)
        check("another phase is another picture", differ(still, pixels(browser)) > 0.003, differ(still, pixels(browser)))
        browser.execute_script("kschur.state.phase = 0")
        click(browser, "play")
        wait_frames(browser)
        check("it plays", browser.execute_script("return kschur.state.phase") > 0)
        click(browser, "play")
        browser.execute_script("kschur.state.phase = 0")
        before = browser.execute_script("return kschur.camera().azimuth")
        ActionChains(browser).drag_and_drop_by_offset(browser.find_element(By.ID, "overlay"), 100, 20).perform()
        wait_frames(browser)
        check("it turns", abs(browser.execute_script("return kschur.camera().azimuth") - before + 40) < 5 and differ(still, pixels(browser)) > 0.003)
        for k in (8, 9, 10):
            rows[k].find_element(By.TAG_NAME, "input").click()
        wait_for(browser, "return kschur.state.shapes.length == 4")
        wait_frames(browser)
        picture = pixels(browser)
        quarters = [coloured(half) for rows in np.array_split(picture, 2) for half in np.array_split(rows, 2, axis=1)]
        check("four side by side", min(quarters) > 0.001, quarters)
        click(browser, "picture")
        wait_for(browser, "return kschur.state.saved && kschur.state.saved.size > 5000")
        check("a picture is saved", browser.execute_script("return kschur.state.saved.name") == "shapes.png")
        browser.execute_script("kschur.state.saved = null; document.getElementById('speed').value = 2")
        click(browser, "film")
        wait_for(browser, "return kschur.state.saved && kschur.state.saved.size > 1000")
        check("a film is saved", browser.execute_script("return kschur.state.saved.name") == "shapes.webm")
        macs = np.array(browser.execute_script("return kschur.facts.mac"))
        unit = (shapes / np.linalg.norm(shapes, axis=1)[:, None]).T
        check("MAC", np.allclose(macs, abs(unit.conj().T @ unit)**2, atol=1e-4))
        check_console(browser, "grid")
    finally:
        browser.quit()


def package():
    """That of Python, with the library of the program's build."""
    os.environ.setdefault("KSCHUR_LIBRARY", str(Path(KSCHUR).resolve().parents[1]/"capi/libkschur_capi.so"))
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]/"python"))
    return importlib.import_module("kschur")


def test_energies_and_constraints(folder):
    """Strain energy is a choice of colours, and constraints are drawn, where their matrices are given; else neither is there."""
    browser = open_browser()
    try:
        load(browser, page_of(folder, "crank", "crank", "--modes", 12))
        choices = "return Array.from(document.querySelectorAll('#colour option')).map(one => one.text).join()"
        check("without matrices: no strain energy", "energy" not in browser.execute_script(choices))
        with h5py.File(folder/"crank.h5") as file:
            stiffness, constraints = (sparse.csr_matrix((group["data"][:], group["indices"][:], group["indptr"][:]), tuple(group.attrs["shape"]))
                                      for group in (file["stiffness"], file["constraints"]))
        result = package().load(folder/"crank_modes.h5")
        result.view(stiffness=stiffness, constraints=constraints).save(folder/"energies.html")
        page = folder/"of_program.html"
        kschur("view", folder/"crank_modes.h5", "--html", page, "--problem", folder/"crank.h5")
        check("the program makes the same page", page.read_bytes() == (folder/"energies.html").read_bytes())
        load(browser, page)
        check("strain energy is a choice", browser.execute_script(choices).endswith("strain energy"))
        energies = np.array([np.vdot(phi, stiffness @ phi).real / 4 for phi in result.shapes.T])
        found = np.array(browser.execute_script("return kschur.facts.modes.map(mode => mode.energy)"))
        check("sums over nodes are phi^* K phi / 4", np.allclose(found, energies, rtol=1e-9, atol=1e-12 * energies.max()), (found, energies))
        browser.execute_script("kschur.state.playing = false; kschur.state.phase = 0.6")
        wait_frames(browser)
        before = pixels(browser)
        browser.execute_script("document.getElementById('colour').value = '5'")
        wait_frames(browser)
        wait_frames(browser)
        by_energy = pixels(browser)
        check("its colours are others", differ(before, by_energy) > 0.001, differ(before, by_energy))
        check("and so is the key", differ(before[-145:-100, -60:], by_energy[-145:-100, -60:]) > 0.01)
        drawn = browser.execute_async_script("const done = arguments[0]; models.get(0).then(model => done(model.ties.length / 2 + model.marks.length))")
        check("constraints are drawn", drawn > 0, drawn)
        browser.execute_script("Array.from(document.querySelectorAll('#parts label')).find(one => one.textContent === 'constraints').firstChild.click()")
        time.sleep(0.5)
        wait_frames(browser)
        check("and hidden in the list of parts", differ(by_energy, pixels(browser)) > 0.00005, differ(by_energy, pixels(browser)))
        check_console(browser, "energies")
    finally:
        browser.quit()


def test_models(folder):
    """Lines, shells, solids and complex shapes are drawn."""
    browser = open_browser()
    try:
        for name, scene, *options in (("turbine", "turbine", "--modes", 8), ("rotor", "rotor --speed 2000", "--modes", 8),
                                      ("crank", "crank", "--modes", 12), ("block", "block", "--modes", 8), ("shell", "shell", "--modes", 8)):
            load(browser, page_of(folder, name, scene, *options))
            browser.execute_script("kschur.state.playing = false; kschur.state.phase = 0.6")
            wait_frames(browser)
            picture = pixels(browser)
            check(f"{name}: is drawn", coloured(picture) > 0.002, coloured(picture))
            check_console(browser, name)
            if PICTURES:
                browser.save_screenshot(f"{PICTURES}/view-{name}.png")
        with h5py.File(folder/"rotor_modes.h5") as file:
            check("rotor: shapes are complex, and have two parts", abs(file["eigenvectors"][:].imag).max() > 0.01
                  and 'id="mode-0-im"' in (folder/"rotor.html").read_text())
        if PICTURES:
            load(browser, page_of(folder, "grid", "grid", "--modes", 20))
            browser.execute_script("kschur.state.playing = false; kschur.state.phase = 0; kschur.choose([12, 13, 14, 15])")
            wait_frames(browser, 4)
            browser.save_screenshot(f"{PICTURES}/view-grid.png")
    finally:
        browser.quit()


def plate(folder, columns, rows, modes):
    """A page of modes of a plate whose nodes stand in no order, as meshers may leave them."""
    y, x = np.mgrid[:rows, :columns].reshape(2, -1)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    quads = np.column_stack([corner, corner + 1, corner + columns + 1, corner + columns])
    order = np.random.default_rng(0).permutation(rows * columns)
    chain = [sparse.diags([np.full(k - 1, -1.0), np.full(k, 2.0), np.full(k - 1, -1.0)], [-1, 0, 1]) for k in (rows, columns)]
    stiffness = sparse.kronsum(chain[1], chain[0], format="csr")[order][:, order]
    with h5py.File(folder/"plate.h5", "w") as file:
        for name, matrix in {"mass": sparse.identity(rows * columns, format="csr"), "stiffness": stiffness}.items():
            group = file.create_group(name)
            group.attrs["shape"] = matrix.shape
            group["indptr"], group["indices"], group["data"] = matrix.indptr, matrix.indices, matrix.data
        file["coordinates"] = np.column_stack([x, y, 0 * x])[order].astype(float)
        file["cells/types"], file["cells/offsets"] = np.full(len(quads), 9), np.arange(0, quads.size + 1, 4)
        file["cells/connectivity"] = np.argsort(order)[quads].ravel()
    kschur("solve", folder/"plate.h5", "--modes", modes, "--output", folder/"plate_modes.h5")
    kschur("view", folder/"plate_modes.h5", "--html", folder/"plate.html")
    return folder/"plate.html"


def test_a_large_model(folder):
    """Where software draws, its motion is that of a coarse surface, and what is at rest is whole; nothing is drawn twice."""
    browser = open_browser()
    try:
        load(browser, plate(folder, 150, 100, 3))
        drawn = "return [software, renderer.info.render.triangles, renderer.info.render.frame, document.getElementById('space').width]"
        moving = browser.execute_script(drawn)
        click(browser, "play")
        wait_frames(browser)
        rest = browser.execute_script(drawn)
        still = pixels(browser)
        check("a moving plate is coarse", moving[0] and 5000 < moving[1] < 25000 and rest[1] == 2 * 149 * 99, (moving, rest))
        check("at rest its picture is twice as fine", rest[3] == 2 * moving[3], (moving, rest))
        wait_frames(browser, 5)
        check("what does not change is not drawn again", browser.execute_script(drawn)[2] == rest[2])
        browser.execute_script("draw(false, false)")
        check("both look nearly the same", differ(still, pixels(browser)) < 0.15, differ(still, pixels(browser)))
        check_console(browser, "plate")
    finally:
        browser.quit()


def measure_rates(folder):
    browser = open_browser()
    for columns, rows in ((100, 100), (400, 250), (500, 400)):
        page = plate(folder, columns, rows, 20)
        load(browser, page)
        first, start = browser.execute_script("return kschur.state.frames"), time.time()
        time.sleep(10)
        rate = (browser.execute_script("return kschur.state.frames") - first) / (time.time() - start)
        browser.execute_script("kschur.state.playing = false")
        wait_frames(browser)
        start = time.time()
        browser.execute_script("draw(true, false); composed().toDataURL()")
        whole = time.time() - start
        print(f"{rows * columns} nodes: {page.stat().st_size / 1e6:.1f} MB, {rate:.1f} frames a second, at rest a picture in {whole:.2f} s", flush=True)
    browser.quit()


run_tests(*([measure_rates] if "--rates" in sys.argv else [test_a_page, test_energies_and_constraints, test_models, test_a_large_model]))
