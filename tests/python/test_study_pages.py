"""Pages of kschur sweep --html and kschur response --html, in a headless Chromium: test_study_pages.py KSCHUR [--pictures FOLDER].

It hovers and clicks, and compares what the pages say with the files.
"""
import json
import re
import subprocess

import h5py
import numpy as np
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By

from browser import KSCHUR, check_console, click, coloured, differ, kschur, load, open_browser, pictures_folder, pixels, wait_for, wait_frames
from checks import check, run_tests

PICTURES = pictures_folder()


def at_point(browser, chart, line, k):
    """Where a point of a diagram is, from the middle of its canvas as the driver counts."""
    return browser.execute_script(f"const chart = kschur.charts[{chart}], line = chart.lines[{line}], [u, v] = chart.at(line.x[{k}], line.y[{k}]);"
                                  "return [u - chart.canvas.clientWidth / 2, v - chart.canvas.clientHeight / 2]")


def hover(browser, canvas, chart, line, k):
    u, v = at_point(browser, chart, line, k)
    return ActionChains(browser).move_to_element_with_offset(browser.find_element(By.ID, canvas), round(u), round(v))


def ink(browser, canvas):
    """The part of a canvas that is coloured, with red and without."""
    counts = browser.execute_script(f"const c = document.getElementById('{canvas}'), p = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
                                    "let ink = 0, red = 0; for (let i = 0; i < p.length; i += 4) { const [r, g, b, a] = p.slice(i, i + 4);"
                                    "if (a > 200 && Math.max(r, g, b) - Math.min(r, g, b) > 60) ++ink; if (a > 200 && r > 190 && g < 60 && b < 40) ++red; }"
                                    "return [ink * 4 / p.length, red * 4 / p.length]")
    return counts


def test_a_sweep(folder):
    folder = folder/"sweep"
    folder.mkdir()
    kschur("sweep", "rotor", "--vary", "speed=1000:7000:7", "--unit", "rpm", "--modes", 4, "--orders", "1,2",
           "--html", folder/"sweep.html", "--output", folder/"sweep.h5")
    check("nothing else is left in the folder", {path.name for path in folder.iterdir()} == {"sweep.html", "sweep.h5"}, list(folder.iterdir()))
    with h5py.File(folder/"sweep.h5") as file:
        eigenvalues, values, onsets = file["eigenvalues"][:], file["values"][:], file["onsets/value"][:]
    browser = open_browser()
    try:
        load(browser, folder/"sweep.html")
        facts = browser.execute_script("return kschur.facts")
        damped = np.array([branch["hertz"] for branch in facts["branches"]], float).T
        check("sweep: frequencies are those of the file", np.allclose(damped, abs(eigenvalues.imag) / 2 / np.pi, rtol=1e-8))
        check("sweep: and so are real parts", np.allclose(np.array([branch["re"] for branch in facts["branches"]]).T, eigenvalues.real, rtol=1e-8))
        check("sweep: unstable where the real part is positive", [any(branch["unstable"]) for branch in facts["branches"]] ==
              (eigenvalues.real > 1e-9 * abs(eigenvalues)).any(axis=0).tolist() and len(onsets) == 1)
        check("sweep: the onset", np.isclose(facts["onsets"][0]["value"], onsets[0]))
        check("sweep: the axis has its unit", browser.execute_script("return kschur.charts[0].axes.x.label") == "speed (rpm)")
        guides = browser.execute_script("return kschur.charts[0].guides")
        check("sweep: orders are multiples of the speed", [g["text"] for g in guides] == ["1P", "2P"] and
              all(np.isclose(g["y"][1], order * g["x"][1] / 60) for order, g in zip((1, 2), guides)), guides)
        for canvas in ("campbell", "roots"):
            colour, red = ink(browser, canvas)
            check(f"sweep: {canvas} is drawn, with what is unstable in red", colour > 0.002 and red > 0.0002, (colour, red))
        click(browser, "play")
        browser.execute_script("kschur.state.phase = 0.6")
        wait_frames(browser)
        before = pixels(browser)
        check("sweep: a shape is drawn", coloured(before) > 0.002, coloured(before))
        hover(browser, "campbell", 0, 3, 4).perform()
        wait_for(browser, "return document.getElementById('tip').style.display === ''")
        text = browser.find_element(By.ID, "tip").text
        check("sweep: hover tells branch, value and frequency", "branch 4" in text and "5000 rpm" in text and f"{damped[4, 3]:.5g}"[:5] in text, text)
        hover(browser, "roots", 1, 3, 4).click().perform()
        wait_for(browser, "return kschur.state.seen[0].title.startsWith('Branch 4') && kschur.state.shapes.length === 1")
        wait_frames(browser)
        check("sweep: a click shows the shape at that point", browser.execute_script("return kschur.state.seen[0].title") == "Branch 4 at speed 5000 rpm"
              and differ(before, pixels(browser)) > 0.002, browser.execute_script("return kschur.state.seen"))
        check("sweep: and says which it is", f"{damped[4, 3]:.5g}"[:5] in browser.find_element(By.ID, "chosen").text)
        # The shape is that of a solve at this speed, whose modes may be of any phase.
        number = facts["shapes"][3][4]
        parts = [np.array(browser.execute_async_script(f"const done = arguments[0]; displacements('mode-{number}-{part}').then(x => done(Array.from(x)))"))
                 for part in ("re", "im")]
        kschur("scene", "rotor", "--speed", 5000, "--output", folder/"at.h5")
        kschur("solve", folder/"at.h5", "--modes", 4, "--output", folder/"at_modes.h5")
        with h5py.File(folder/"at_modes.h5") as file:
            mode = np.argmin(abs(abs(file["eigenvalues"][:].imag) - 2 * np.pi * damped[4, 3]))
            node, component, shape, places = (file[name][:] for name in ("unknown_node", "unknown_component", "eigenvectors", "coordinates"))
        moved = np.zeros((node.max() + 1, 3), complex)
        moved[node[component < 3], component[component < 3]] = shape[mode][component < 3]
        read = (parts[0] + 1j * parts[1]).reshape(-1, 3)
        at = np.array(browser.execute_async_script("const done = arguments[0]; floatingNumbers('model-0-coordinates').then(x => done(Array.from(x)))")).reshape(-1, 3)
        read, moved = read[np.lexsort(np.float32(at).T)].ravel(), moved[np.lexsort(np.float32(places).T)].ravel()
        mac = abs(np.vdot(read, moved))**2 / (np.vdot(read, read) * np.vdot(moved, moved)).real
        check("sweep: the shape is that of a solve there", mac > 1 - 1e-5, mac)
        if PICTURES:
            browser.save_screenshot(f"{PICTURES}/view-sweep.png")
        entries = browser.find_elements(By.CSS_SELECTOR, "#legend button")
        before = ink(browser, "campbell")
        entries[0].click()
        check("sweep: the legend hides a branch", len(entries) == 4 and ink(browser, "campbell")[0] < before[0])
        check_console(browser, "sweep")
        kschur("sweep", "rotor", "--vary", "speed=1000:7000:4", "--modes", 25, "--html", folder/"many.html")
        load(browser, folder/"many.html")
        inside = browser.execute_script("return document.body.scrollWidth <= innerWidth && document.body.scrollHeight <= innerHeight")
        check("sweep: 25 branches fit", inside and len(browser.find_elements(By.CSS_SELECTOR, "#legend button")) >= 25)
    finally:
        browser.quit()


def test_points_with_their_own_models(folder):
    """A beam of three lengths."""
    kschur("sweep", "cantilever", "--vary", "length=2:6:3", "--modes", 2, "--shapes", "--html", folder/"own.html", "--output", folder/"own.h5")
    browser = open_browser()
    try:
        load(browser, folder/"own.html")
        browser.execute_script("kschur.state.playing = false; kschur.state.phase = 0")
        pictures = []
        for point in range(3):
            browser.execute_script(f"kschur.choose(kschur.charts[0].lines[0], {point})")
            wait_for(browser, f"return kschur.state.seen[0].title.endsWith('{2 + 2 * point}') && kschur.state.shapes.length === 1")
            wait_frames(browser, 3)
            read = browser.execute_script("return Array.from(kschur.state.shapes[0].pieces[0].geometry.attributes.position.array)")
            with h5py.File(folder/"own.h5") as file:
                places = file[f"points/{point + 1}/coordinates"][:]
            read = np.reshape(read, (-1, 3))
            check(f"point {point + 1} is drawn on its own geometry", np.allclose(read[np.lexsort(read.T)], places[np.lexsort(np.float32(places).T)], atol=1e-6),
                  (np.ptp(read, axis=0), np.ptp(places, axis=0)))
            pictures.append(pixels(browser))
        check("and pictures tell them apart", min(differ(pictures[0], pictures[1]), differ(pictures[1], pictures[2])) > 0.001)
        check_console(browser, "lengths")
    finally:
        browser.quit()


def write_chain(path):
    """Four masses of 1 kg between walls, springs of 100 N/m, some damping; nowhere in space."""
    matrices = {"mass": np.eye(4), "stiffness": 200 * np.eye(4) - 100 * (np.eye(4, k=1) + np.eye(4, k=-1)), "damping": 0.4 * np.eye(4)}
    with h5py.File(path, "w") as file:
        for name, matrix in matrices.items():
            group = file.create_group(name)
            group.attrs["shape"] = matrix.shape
            rows, columns = np.nonzero(matrix)
            group["indptr"], group["indices"], group["data"] = np.searchsorted(rows, range(5)), columns, matrix[rows, columns]
    return matrices


def test_a_response(folder):
    kschur("scene", "grid", "--output", folder/"grid.h5")
    kschur("response", folder/"grid.h5", "--frequencies", "0.2:12:60", "--input", 63, "--at", "63,99", "--html", folder/"response.html",
           "--output", folder/"response.h5")
    with h5py.File(folder/"response.h5") as file:
        x, hz = file["response"][:], file["frequency_hz"][:]
        check("response: its file says where the unknowns stand", {"coordinates", "unknown_node", "cells"} <= set(file))
    browser = open_browser()
    try:
        load(browser, folder/"response.html")
        facts = browser.execute_script("return kschur.facts")
        read = np.array([np.array(unknown["re"]) + 1j * np.array(unknown["im"]) for unknown in facts["unknowns"]])
        check("response: numbers are those of the file", np.allclose(read.T, x[:, [62, 98]], rtol=1e-8) and np.allclose(facts["frequencies"], hz))
        check("response: an unknown has node and direction", "unknown 63: node" in facts["unknowns"][0]["name"], facts["unknowns"][0]["name"])
        for canvas in ("amplitude-plot", "phase-plot", "nyquist-plot"):
            check(f"response: {canvas} is drawn", ink(browser, canvas)[0] > 0.001, ink(browser, canvas))
        highest = int(abs(x[:, 62]).argmax())
        check("response: opens at the largest amplitude", browser.execute_script("return kschur.charts[0].picked.k") == highest)
        click(browser, "play")
        browser.execute_script("kschur.state.phase = 0.6")
        wait_frames(browser)
        before = pixels(browser)
        check("response: the deformed structure is drawn", coloured(before) > 0.002, coloured(before))
        other = 5 if highest > 20 else 45
        hover(browser, "amplitude-plot", 0, 1, other).click().perform()
        wait_for(browser, f"return kschur.charts[2].picked && Math.abs(kschur.charts[2].picked.k - {other}) < 3 && kschur.state.shapes.length === 1")
        wait_frames(browser)
        check("response: a click shows another frequency", differ(before, pixels(browser)) > 0.002 and " Hz" in browser.execute_script("return kschur.state.seen[0].title"))
        k = browser.execute_script("return kschur.charts[2].picked.k")
        told = re.search(r"unknown (\d+): .*amplitude (.+), phase (.+)°", browser.find_element(By.ID, "chosen").text)
        value = x[k, int(told.group(1)) - 1]
        check("response: and tells amplitude and phase", np.isclose(float(told.group(2)), abs(value), rtol=1e-2)
              and np.isclose(float(told.group(3)), np.degrees(np.angle(value)), atol=0.5), (told.group(0), value))
        if PICTURES:
            browser.save_screenshot(f"{PICTURES}/view-response.png")
        click(browser, "log-frequency")
        check("response: frequencies in decades", browser.execute_script("return kschur.charts[0].axes.x.high") < 3)
        check_console(browser, "response")
        matrices = write_chain(folder/"chain.h5")
        kschur("response", folder/"chain.h5", "--frequencies", "0.5:4:8", "--input", 1, "--html", folder/"plain.html")
        load(browser, folder/"plain.html")
        read = browser.execute_script("return kschur.facts.unknowns[0]")
        s = 2j * np.pi * np.linspace(0.5, 4, 8)
        wanted = [np.linalg.solve(p * p * matrices["mass"] + p * matrices["damping"] + matrices["stiffness"], np.eye(4)[0])[0] for p in s]
        check("response: without a geometry, diagrams alone", np.allclose(np.array(read["re"]) + 1j * np.array(read["im"]), wanted, rtol=1e-7)
              and not browser.find_elements(By.ID, "stage") and ink(browser, "nyquist-plot")[0] > 0.001)
        check_console(browser, "plain response")
    finally:
        browser.quit()


def test_refusals(folder):
    for words, message in ((("sweep", "rotor", "--vary", "speed=1:2:2", "--html", folder/"s.html", "--orders", "1"), "--unit"),
                           (("sweep", "rotor", "--vary", "speed=1:2:2", "--unit", "rpm", "--orders", "1"), "--html"),
                           (("sweep", "rotor", "--vary", "speed=1:2:2", "--unit", "rpm", "--html", folder/"s.html", "--orders", "x"), "not 'x'")):
        done = subprocess.run([KSCHUR, *map(str, words)], capture_output=True, text=True)
        check(f"refused: {message}", done.returncode == 1 and message in done.stderr and not list(folder.glob("s.html*")), done)
    done = subprocess.run([KSCHUR, "sweep", "rotor", "--vary", "speed=1000:2000:2", "--modes", "2", "--format", "json", "--html", str(folder/"j.html")],
                          capture_output=True, text=True)
    check("JSON stays JSON", done.returncode == 0 and len(json.loads(done.stdout)["points"]) == 2 and (folder/"j.html").exists(), done)


run_tests(test_refusals, test_a_sweep, test_points_with_their_own_models, test_a_response)
