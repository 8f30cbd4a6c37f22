"""A browser for the report's page, and a reader who clicks, presses keys and looks."""

import base64
import importlib.util
import io
import os
import shutil
from contextlib import contextmanager

import pytest
from children import TIMES_QUIET
from PIL import Image

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
NEEDS_BROWSER = [
    pytest.mark.slow,
    pytest.mark.skipif(importlib.util.find_spec("selenium") is None, reason="selenium is not installed"),
    pytest.mark.skipif(not (BROWSER and DRIVER), reason="there is no Chromium with its driver on this machine"),
]
FLAGS = ["--headless", "--no-sandbox", "--no-first-run", "--window-size=1280,1000"]
FLAGS += [f"--disable-{name}" for name in ("gpu", "quic", "background-networking", "component-update", "sync")]


@contextmanager
def open_browser(folder):
    """Open a browser that keeps its files in a folder, and close it at the end."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    for flag in (*FLAGS, f"--user-data-dir={folder}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(
        options=options, service=webdriver.ChromeService(DRIVER, env={**os.environ, "SE_OFFLINE": "true"})
    )
    driver.set_script_timeout(TIMES_QUIET * 6)
    try:
        yield driver
    finally:
        driver.quit()


class Reader:
    """A reader of one page; ``assert_quiet`` checks that the page logged and loaded nothing."""

    def __init__(self, browser, path):
        self.browser = browser
        browser.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": 1280, "height": 1000, "deviceScaleFactor": 1, "mobile": False},
        )
        browser.get(path.as_uri())
        self.ask("localStorage.clear()")
        browser.refresh()
        self.wait("document.documentElement.dataset.charts === 'drawn' || !document.querySelector('.chart')")

    def ask(self, wanted):
        return self.browser.execute_script(f"return {wanted}")

    def wait(self, wanted):
        script = f"const done = arguments[0]; (function look() {{ ({wanted}) ? done(true) : setTimeout(look, 20) }})()"
        assert self.browser.execute_async_script(script)

    def click(self, ident):
        self.browser.find_element("id", ident).click()

    def choose(self, ident, value):
        self.ask(f"(byId('{ident}').value = '{value}', byId('{ident}').dispatchEvent(new Event('change')))")
        assert self.ask(f"byId('{ident}').value") == str(value)

    def press(self, keys, ident=None):
        element = self.browser.find_element("id", ident) if ident else self.browser.find_element("tag name", "body")
        element.send_keys(keys)

    @property
    def step(self):
        moment = int(self.ask("byId('now-step').textContent").split()[0])
        assert self.ask("Number(byId('scrub').value)") == moment
        return moment

    def picture(self, ident):
        data = self.ask(f"byId('{ident}').toDataURL()")
        with Image.open(io.BytesIO(base64.b64decode(data.partition(",")[2]))) as image:
            assert len(image.convert("RGB").getcolors(1 << 20)) > 3
        return data

    def text(self, ident):
        return self.ask(f"byId('{ident}').textContent")

    def assert_quiet(self):
        assert self.browser.get_log("browser") == []
        assert self.ask("performance.getEntriesByType('resource').map((one) => one.name)") == []
