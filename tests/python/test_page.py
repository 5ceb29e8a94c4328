"""Pages of kschur view --html, in a headless Chromium: test_page.py KSCHUR [--pictures FOLDER] [--rates].

It clicks, turns and plays, and compares what the page says with the file. With --pictures the pictures of docs are kept, with --rates
frames are counted with 10,000, 100,000 and 200,000 nodes, by hand.
"""
import base64
import io
import subprocess
import sys
import time

import h5py
import matplotlib.image
import numpy as np
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from checks import check, run_tests

KSCHUR = sys.argv[1]
# Seconds to wait for the browser, which draws by software, on a machine that others use too.
PATIENCE = 240
PICTURES = sys.argv[sys.argv.index("--pictures") + 1] if "--pictures" in sys.argv else None


def open_browser():
    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    for word in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--use-gl=angle",
                 "--enable-unsafe-swiftshader", "--window-size=1280,800", "--force-device-scale-factor=1"):
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)


def kschur(*words):
    done = subprocess.run([KSCHUR, *map(str, words)], capture_output=True, text=True, timeout=300)
    check("kschur " + " ".join(map(str, words[:2])), done.returncode == 0, done.stderr)
    return done


def page_of(folder, name, scene, *options):
    kschur("scene", *scene.split(), "--output", folder/f"{name}.h5")
    kschur("solve", folder/f"{name}.h5", *options, "--output", folder/f"{name}_modes.h5")
    kschur("view", folder/f"{name}_modes.h5", "--html", folder/f"{name}.html")
    return folder/f"{name}.html"


def load(browser, page):
    browser.get(f"file://{page}")
    WebDriverWait(browser, PATIENCE).until(lambda b: b.execute_script("return window.kschur && kschur.state.ready && kschur.state.frames > 1"))


def pixels(browser):
    """The stage at this moment."""
    text = browser.execute_script("return composed().toDataURL('image/png')")
    return matplotlib.image.imread(io.BytesIO(base64.b64decode(text.split(",")[1])))[:, :, :3]


def wait_frames(browser, count=2):
    first = browser.execute_script("return kschur.state.frames")
    WebDriverWait(browser, PATIENCE).until(lambda b: b.execute_script("return kschur.state.frames") >= first + count)


def coloured(picture):
    return float((np.ptp(picture[50:-60, 20:-60], axis=2) > 0.15).mean())


def differ(first, second):
    return float((abs(first - second).max(axis=2) > 0.05).mean())


def click(browser, name):
    browser.find_element(By.ID, name).click()


def test_a_page(folder):
    browser = open_browser()
    try:
        load(browser, page_of(folder, "grid", "grid", "--modes", 12, "--properties"))
        with h5py.File(folder/"grid_modes.h5") as file:
            frequencies, shapes = file["frequency_hz"][:], file["eigenvectors"][:]
            node, component = file["unknown_node"][:], file["unknown_component"][:]
        rows = browser.find_elements(By.CSS_SELECTOR, "#list tbody tr")
        check("a row for each mode", len(rows) == 12)
        check("frequencies are those of the file", np.allclose([float(row.get_attribute("data-frequency")) for row in rows], frequencies, rtol=1e-14, atol=0))
        shown = [float(row.find_elements(By.TAG_NAME, "td")[2].text) for row in rows]
        check("and so they read", np.allclose(shown, frequencies, rtol=1e-2, atol=0), shown)
        check("effective masses are listed", "mass z %" in browser.find_element(By.CSS_SELECTOR, "#list thead").text)
        click(browser, "play")
        browser.execute_script("kschur.state.phase = 0")
        rows[7].click()
        WebDriverWait(browser, PATIENCE).until(lambda b: b.execute_script("return kschur.state.chosen.join() == '7'"))
        moved = np.zeros((node.max() + 1, 3), complex)
        moved[node[component < 3], component[component < 3]] = shapes[7][component < 3]
        moved /= np.sqrt((abs(moved)**2).sum(1).max())
        read = np.array(browser.execute_async_script("const done = arguments[0]; displacements('mode-7-re').then(x => done(Array.from(x)))"))
        check("the shape is that of the file", abs(read.reshape(-1, 3) / 32767 - moved.real).max() < 5e-4)
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
        WebDriverWait(browser, PATIENCE).until(lambda b: b.execute_script("return kschur.state.shapes.length") == 4)
        wait_frames(browser)
        picture = pixels(browser)
        quarters = [coloured(half) for rows in np.array_split(picture, 2) for half in np.array_split(rows, 2, axis=1)]
        check("four side by side", min(quarters) > 0.001, quarters)
        click(browser, "picture")
        WebDriverWait(browser, PATIENCE).until(lambda b: b.execute_script("return kschur.state.saved && kschur.state.saved.size > 5000"))
        check("a picture is saved", browser.execute_script("return kschur.state.saved.name") == "modes.png")
        browser.execute_script("kschur.state.saved = null; document.getElementById('speed').value = 2")
        click(browser, "film")
        WebDriverWait(browser, PATIENCE).until(lambda b: b.execute_script("return kschur.state.saved && kschur.state.saved.size > 1000"))
        check("a film is saved", browser.execute_script("return kschur.state.saved.name") == "modes.webm")
        macs = np.array(browser.execute_script("return kschur.facts.mac"))
        unit = (shapes / np.linalg.norm(shapes, axis=1)[:, None]).T
        check("MAC", np.allclose(macs, abs(unit.conj().T @ unit)**2, atol=1e-4))
        check("no errors in the console", not [line for line in browser.get_log("browser") if line["level"] == "SEVERE"], browser.get_log("browser"))
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
            check(f"{name}: no errors", not [line for line in browser.get_log("browser") if line["level"] == "SEVERE"], browser.get_log("browser"))
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


def measure_rates(folder):
    import kschur as package
    import scipy.sparse as sparse
    from kschur.page import View
    browser = open_browser()
    for columns, rows in ((100, 100), (400, 250), (500, 400)):
        y, x = np.mgrid[:rows, :columns].reshape(2, -1)
        corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
        quads = np.column_stack([corner, corner + 1, corner + columns + 1, corner + columns])
        geometry = package.Geometry(np.column_stack([x, y, 0 * x]), cells={"quad": quads})
        chain = [sparse.diags([np.full(k - 1, -1.0), np.full(k, 2.0), np.full(k - 1, -1.0)], [-1, 0, 1]) for k in (rows, columns)]
        stiffness = sparse.kronsum(chain[1], chain[0], format="csr")
        result = package.solve(sparse.identity(rows * columns, format="csr"), stiffness, modes=20, geometry=geometry)
        page = folder/f"{rows * columns}.html"
        View(result).save(page)
        load(browser, page)
        first, start = browser.execute_script("return kschur.state.frames"), time.time()
        time.sleep(10)
        rate = (browser.execute_script("return kschur.state.frames") - first) / (time.time() - start)
        print(f"{rows * columns} nodes, {len(result)} modes: {page.stat().st_size / 1e6:.2f} MB, {rate:.1f} frames a second", flush=True)
    browser.quit()


run_tests(*([measure_rates] if "--rates" in sys.argv else [test_a_page, test_models]))
