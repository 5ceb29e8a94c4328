"""A headless Chromium that tests of pages look through; the first argument of the test is the program."""
import base64
import io
import subprocess
import sys

import matplotlib.image
import numpy as np
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from checks import check

KSCHUR = sys.argv[1]
# Seconds to wait for the browser, which draws by software, on a machine that others use too.
PATIENCE = 240


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


def load(browser, page):
    browser.get(f"file://{page}")
    wait_for(browser, "return window.kschur && (!kschur.state || kschur.state.ready && kschur.state.frames > 1)")


def wait_for(browser, script):
    WebDriverWait(browser, PATIENCE).until(lambda b: b.execute_script(script))


def check_console(browser, name):
    errors = [line for line in browser.get_log("browser") if line["level"] == "SEVERE"]
    check(f"{name}: no errors in the console", not errors, errors)


def pictures_folder():
    """Where --pictures wants the pictures of docs; None where it does not."""
    return sys.argv[sys.argv.index("--pictures") + 1] if "--pictures" in sys.argv else None


def pixels(browser):
    """The stage at this moment."""
    text = browser.execute_script("return composed().toDataURL('image/png')")
    return matplotlib.image.imread(io.BytesIO(base64.b64decode(text.split(",")[1])))[:, :, :3]


def wait_frames(browser, count=2):
    """So many pictures, and that in full of what is at rest."""
    first = browser.execute_script("return kschur.state.frames")
    WebDriverWait(browser, PATIENCE).until(lambda b: b.execute_script("return kschur.state.frames") >= first + count)
    wait_for(browser, "return kschur.state.playing || kschur.state.still")


def coloured(picture):
    return float((np.ptp(picture[50:-60, 20:-60], axis=2) > 0.15).mean())


def differ(first, second):
    return float((abs(first - second).max(axis=2) > 0.05).mean())


def click(browser, name):
    browser.find_element(By.ID, name).click()
