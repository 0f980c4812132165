# SPDX-License-Identifier: MIT
"""Debian's Chromium without a window, and what it shows of the page."""
import base64
import json
import pathlib
import time

from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains

HERE = pathlib.Path(__file__).resolve().parent
SIZES = {"phone": (390, 844), "panel": (1920, 1080)}

# Texts that the page shows, as rectangles; two of different elements must not overlap.
TEXTS = """
const found = [];
const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
for (let node = walk.nextNode(); node; node = walk.nextNode()) {
  const parent = node.parentElement;
  if (!node.textContent.trim() || !parent.checkVisibility()) continue;
  if (parent.closest("option, .skip, script, noscript")) continue;
  const clip = parent.closest(".scrolls")?.getBoundingClientRect();
  const range = document.createRange();
  range.selectNodeContents(node);
  for (const box of range.getClientRects()) {
    const bottom = Math.min(box.bottom, clip?.bottom ?? Infinity);
    if (box.width < 1 || bottom - box.top < 1) continue;
    found.push({text: node.textContent.trim(), left: box.left, right: box.right, top: box.top, bottom,
                size: parseFloat(getComputedStyle(parent).fontSize)});
  }
}
return found;
"""


class Browser:
    def __init__(self):
        options = webdriver.ChromeOptions()
        for word in ("--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run",
                     "--disable-background-networking", "--disable-component-update", "--disable-sync"):
            options.add_argument(word)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        self.requests, self.complaints = [], []

    def close(self):
        self.driver.quit()

    def look(self, size, dark=False):
        """The window of a phone or a panel, of a person who prefers dark or light."""
        width, height = SIZES[size]
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": size == "phone"})
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]})

    def open(self, url):
        self.driver.get(url)

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def text(self, selector):
        return self.run("return document.querySelector(arguments[0])?.textContent ?? ''", selector)

    def channel(self, name):
        return self.text(f'[data-channel="{name}"] .value')

    def signal(self, name):
        return self.text(f'[data-signal="{name}"] td')

    def until(self, script, *arguments, timeout_s=30):
        """Waits in the page until the script's value is true; out: the value."""
        end = time.monotonic() + timeout_s
        while not (value := self.run(script, *arguments)):
            assert time.monotonic() < end, f"never came: {script} {arguments}: {self.text('#status')}"
            time.sleep(0.02)
        return value

    def until_text(self, selector, part, timeout_s=30):
        return self.until("const text = document.querySelector(arguments[0])?.textContent ?? '';"
                          "return text.includes(arguments[1]) && text", selector, part, timeout_s=timeout_s)

    def until_drawn(self):
        """Waits for the curves of all cards."""
        self.until("const plots = document.querySelectorAll('.plot').length;"
                   "return plots > 0 && document.querySelectorAll('.u-over').length === plots")

    def press(self, *keys):
        ActionChains(self.driver).send_keys(*keys).perform()

    def picture(self, path, whole=True):
        """Writes what the page shows, from its first to its last line; else what a panel shows at once."""
        width, height = self.run("return [innerWidth, document.documentElement.scrollHeight]")
        clip = {"x": 0, "y": 0, "width": width, "height": height if whole else SIZES["panel"][1], "scale": 1}
        shot = self.driver.execute_cdp_cmd("Page.captureScreenshot", {"captureBeyondViewport": True, "clip": clip})
        path.write_bytes(base64.b64decode(shot["data"]))

    def axe(self, program):
        """out: violations that axe-core finds, as lines."""
        self.run(program.read_text())
        result = self.driver.execute_async_script(
            "axe.run(document, {resultTypes: ['violations', 'incomplete']}).then(arguments[0])")
        assert result["passes"], "axe-core looked at nothing"
        return [f"{one['id']}: {one['help']}: {node['target']} {node['failureSummary']}"
                for one in result["violations"] for node in one["nodes"]]

    def texts(self):
        return self.run(TEXTS)

    def logs(self):
        """Keeps each request's address and each complaint of the console."""
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                self.requests.append(message["params"]["request"]["url"])
        self.complaints += [entry["message"] for entry in self.driver.get_log("browser")
                            if entry["level"] in ("SEVERE", "WARNING")]
        return self.requests, self.complaints
