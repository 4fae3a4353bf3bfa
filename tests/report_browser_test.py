#!/usr/bin/env python3
"""Opens reports of synthetic data in headless Chromium and fails on a console error, a request, or a missing piece.

Talks to the browser over --remote-debugging-pipe (JSON messages that end in a zero byte, on file descriptors 3 and 4), so that
it needs nothing beside Python and Chromium. --screenshots FOLDER keeps pictures of the pages, to be looked at.
"""

import argparse
import base64
import contextlib
import json
import os
import pathlib
import select
import subprocess
import tempfile
import time
import unittest

FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--hide-scrollbars", "--remote-debugging-pipe",
]
OPTIONS = argparse.Namespace()
#: Seconds without an answer after which the browser hangs.
PATIENCE = 600


class Browser:
    """A Chromium process and its debugging pipe."""

    def __init__(self, chromium, profile):
        ours_in, theirs_out = os.pipe()
        theirs_in, ours_out = os.pipe()

        def place_pipes():  # through high numbers, since 3 and 4 may be in use for the pipes themselves
            os.dup2(theirs_in, 100)
            os.dup2(theirs_out, 101)
            os.dup2(100, 3)
            os.dup2(101, 4)

        self.process = subprocess.Popen(
            [chromium, *FLAGS, f"--user-data-dir={profile}", "about:blank"], preexec_fn=place_pipes, close_fds=False,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(theirs_in)
        os.close(theirs_out)
        self.input, self.output, self.buffer = ours_in, ours_out, b""
        self.last_id, self.events = 0, []

    def close(self):
        self.process.terminate()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
        os.close(self.input)
        os.close(self.output)

    def _message(self, deadline):
        while b"\0" not in self.buffer:
            if not select.select([self.input], [], [], max(0, deadline - time.monotonic()))[0]:
                raise TimeoutError("Chromium gave no answer")
            part = os.read(self.input, 1 << 20)
            if not part:
                raise RuntimeError("Chromium ended")
            self.buffer += part
        message, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(message)

    def send(self, method, session=None, **params):
        self.last_id += 1
        message = {"id": self.last_id, "method": method, "params": params}
        if session:
            message["sessionId"] = session
        os.write(self.output, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + PATIENCE
        while True:
            answer = self._message(deadline)
            if answer.get("id") == self.last_id:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self.events.append(answer)


class Page:
    """One tab with one report in it."""

    def __init__(self, browser, path, width=1440, height=1000):
        self.browser, self.path = browser, path
        target = browser.send("Target.createTarget", url="about:blank")["targetId"]
        self.session = browser.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        browser.events.clear()
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(f"{domain}.enable")
        self.resize(width, height)
        self.send("Page.navigate", url=path.as_uri())
        deadline = time.monotonic() + PATIENCE
        while not self.evaluate("document.readyState === 'complete' && location.href !== 'about:blank'"):
            if time.monotonic() > deadline:
                raise TimeoutError(f"{path} was not loaded")
            time.sleep(0.02)

    def send(self, method, **params):
        return self.browser.send(method, self.session, **params)

    def resize(self, width, height):
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def evaluate(self, expression):
        result = self.send("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def settle(self):
        """Waits until the browser has laid out and drawn."""
        self.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))")

    def press(self, key):
        self.send("Input.dispatchKeyEvent", type="keyDown", key=key)
        self.send("Input.dispatchKeyEvent", type="keyUp", key=key)

    def screenshot(self, name):
        if not OPTIONS.screenshots:
            return
        pathlib.Path(OPTIONS.screenshots).mkdir(parents=True, exist_ok=True)
        data = self.send("Page.captureScreenshot", format="png", captureBeyondViewport=True)["data"]
        (pathlib.Path(OPTIONS.screenshots) / f"{name}.png").write_bytes(base64.b64decode(data))

    def complaints(self):
        """What the page logged, threw, asked the network for, or popped up."""
        found = []
        for event in self.browser.events:
            method, params = event.get("method"), event.get("params", {})
            if method == "Runtime.exceptionThrown":
                found.append(f"exception: {params['exceptionDetails']}")
            elif method == "Runtime.consoleAPICalled":
                found.append(f"console.{params['type']}: {params['args']}")
            elif method == "Log.entryAdded":
                found.append(f"log: {params['entry']}")
            elif method == "Page.javascriptDialogOpening":
                found.append(f"dialog: {params['message']}")
            elif method == "Network.requestWillBeSent":
                url = params["request"]["url"]
                if url != self.path.as_uri() and not url.startswith("data:"):
                    found.append(f"request: {url}")
        return found


# Bytes of a panel, from a copy: the page's own canvases are not made for being read.
PIXELS = """((canvas) => {
  const context = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d', {willReadFrequently: true});
  context.drawImage(canvas, 0, 0);
  return context.getImageData(0, 0, canvas.width, canvas.height).data;
})"""
# Brightness of all panels that are shown: the mean of their canvases' bytes.
BRIGHTNESS = f"""(() => {{
  let sum = 0, count = 0;
  for (const canvas of document.querySelectorAll('.stage canvas')) {{
    if (canvas.closest('figure').hidden) continue;
    const data = {PIXELS}(canvas);
    for (let i = 0; i < data.length; i += 4) sum += data[i] + data[i + 1] + data[i + 2], count += 3;
  }}
  return sum / count;
}})()"""
SHOWN = "[...document.querySelectorAll('.panels figure')].filter(f => !f.hidden).map(f => f.querySelector('kbd').textContent).join('')"
SECTIONS = "[...document.querySelectorAll('main > [id]')].map(node => node.id)"


class ReportTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.stack = contextlib.ExitStack()
        folder = pathlib.Path(cls.stack.enter_context(tempfile.TemporaryDirectory(ignore_cleanup_errors=True)))
        cls.reports = folder / "reports"
        subprocess.run([OPTIONS.data, cls.reports], check=True)
        cls.browser = Browser(OPTIONS.chromium, folder / "profile")
        cls.stack.callback(cls.browser.close)

    @classmethod
    def tearDownClass(cls):
        cls.stack.close()

    def open(self, name, **size):
        page = Page(self.browser, self.reports / name / "index.html", **size)
        self.addCleanup(lambda: self.assertEqual(page.complaints(), []))
        self.assertEqual(page.evaluate("document.documentElement.dataset.ready"), "true")
        self.assertIsNone(page.evaluate("document.documentElement.dataset.errors"))
        page.settle()
        return page

    def check_everywhere(self, page):
        """What holds for every report."""
        unlabelled = "n => !n.getAttribute('aria-label') && n.getAttribute('aria-hidden') !== 'true'"
        self.assertEqual(page.evaluate(f"[...document.querySelectorAll('main canvas, main svg')].filter({unlabelled}).length"), 0)
        self.assertEqual(page.evaluate("(ids => ids.length - new Set(ids).size)([...document.querySelectorAll('[id]')].map(n => n.id))"), 0)
        self.assertNotRegex(page.evaluate("document.querySelector('main').innerText"), r"undefined|NaN|\[object|Infinity")
        for width in (1440, 420):
            page.resize(width, 1000)
            page.settle()
            self.assertLessEqual(page.evaluate("document.documentElement.scrollWidth"), width, "the page is wider than its window")
        page.resize(1440, 1000)
        page.settle()

    def test_full_report_has_every_part(self):
        page = self.open("full")
        page.screenshot("full")
        self.assertEqual(page.evaluate(SECTIONS), ["head", "gains", "images", "results", "errors", "training", "densities", "provenance"])
        self.assertEqual(page.evaluate("document.querySelector('h1').textContent"), "door ajar")
        self.assertEqual(page.evaluate("document.title"), "scenes/door ajar/scene.xml – warpath")
        self.assertEqual(page.evaluate("document.querySelectorAll('.card').length"), 3)
        self.assertEqual(page.evaluate("document.querySelectorAll('#results thead + tbody')[0].rows.length"), 4)
        self.assertEqual(page.evaluate("document.querySelectorAll('#errors svg.plot').length"), 4)
        self.assertEqual(page.evaluate("document.querySelectorAll('#errors .error').length"), 4 * 4 * 8)
        self.assertEqual(page.evaluate("document.querySelectorAll('#training svg.plot').length"), 2)
        self.assertIn("built in one go in 0.80 s", page.evaluate("document.querySelector('#training').innerText"))
        self.assertEqual(page.evaluate("document.querySelectorAll('#densities .cell canvas').length"), 3 * 3 * 2)
        self.assertIn("18446744073709551615", page.evaluate("document.querySelector('#provenance').innerText"))
        self.check_everywhere(page)

    def test_images_arrive_with_their_values(self):
        page = self.open("full")
        results = json.loads((self.reports / "full" / "results.json").read_text())["results"]
        first = {}
        for run in results:
            first.setdefault(run["method"], sum(run["mean"]) / 3)
        facts = "c => [c.getAttribute('aria-label'), +c.dataset.mean, +c.dataset.lit]"
        shown = page.evaluate(f"[...document.querySelectorAll('.stage canvas')].map({facts})")
        self.assertEqual(len(shown), 5)
        for label, mean, lit in shown:
            self.assertGreater(lit, 0.95, f"{label}: the canvas is black")
            method = label.removeprefix("Rendered image: ")
            if method != "reference":  # half floats: each pixel is off by 2^-11 at most
                self.assertAlmostEqual(mean / first[method], 1, delta=1e-3, msg=label)

    def test_keys_flip_compare_and_expose(self):
        page = self.open("full")
        self.assertEqual(page.evaluate(SHOWN), "R1234")
        for key, shown in [("2", "2"), ("ArrowRight", "3"), ("ArrowLeft", "2"), ("r", "R"), ("ArrowLeft", "4"), ("ArrowRight", "R"), ("s", "R1234")]:
            page.press(key)
            self.assertEqual(page.evaluate(SHOWN), shown, f"after {key}")
        page.press("1")
        page.screenshot("flip")
        page.press("s")

        before = page.evaluate(BRIGHTNESS)
        page.press("e")
        self.assertGreater(page.evaluate(BRIGHTNESS), before + 5)
        self.assertIn("+0.5 EV", page.evaluate("document.querySelector('.toolbar').innerText"))
        page.press("w")
        self.assertAlmostEqual(page.evaluate(BRIGHTNESS), before, places=6)

        pictures = [before]
        for mode in ("Difference", "|Difference|", "relMSE"):
            page.press("d")
            page.settle()
            page.screenshot(f"mode-{mode.strip('|').lower()}{len(pictures)}")
            self.assertEqual(page.evaluate("document.querySelectorAll('.toolbar [aria-pressed=true]')[1].textContent"), mode)
            self.assertEqual(page.evaluate("document.querySelectorAll('.legend .bar').length"), 1)
            pictures.append(page.evaluate(BRIGHTNESS))
        self.assertEqual(len(set(pictures)), 4, "every mode looks different")
        page.press("d")
        self.assertAlmostEqual(page.evaluate(BRIGHTNESS), before, places=6)

    def test_pointer_zooms_all_panels_and_tells_values(self):
        page = self.open("full")
        box = "(n => (n.scrollIntoView(), n.getBoundingClientRect()))(document.querySelector('.stage'))"
        x, y = page.evaluate(f"(b => [b.x + b.width / 2, b.y + b.height / 2])({box})")
        page.send("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-480)
        page.send("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        page.settle()
        self.assertEqual(page.evaluate("document.querySelector('.zoom output').textContent"), "4 ×")
        values = page.evaluate("[...document.querySelectorAll('.value')].map(v => v.textContent)")
        self.assertEqual(len(values), 5)
        for value in values:
            self.assertRegex(value, r"^\((79|80), (44|45)\)  [\d.]+  [\d.]+  [\d.]+$")
        page.screenshot("zoom")
        page.press("z")
        self.assertEqual(page.evaluate("document.querySelector('.zoom output').textContent"), "1 ×")

    def test_keys_leave_sliders_and_shortcuts_alone(self):
        page = self.open("full")
        page.evaluate("document.querySelector('input[type=range]').focus()")
        page.press("ArrowRight")
        self.assertEqual(page.evaluate(SHOWN), "R1234")
        page.send("Input.dispatchKeyEvent", type="keyDown", key="f", modifiers=2)
        self.assertEqual(page.evaluate(SHOWN), "R1234")

    def test_dark_and_light(self):
        page = self.open("full")
        paper = "getComputedStyle(document.body).backgroundColor"
        light = page.evaluate(paper)
        page.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        dark = page.evaluate(paper)
        self.assertNotEqual(light, dark)
        page.settle()
        page.screenshot("dark")
        page.evaluate("document.querySelector('.theme').click()")
        self.assertEqual(page.evaluate(paper), light)
        page.send("Emulation.setEmulatedMedia", features=[])
        page.evaluate("document.querySelector('.theme').click()")
        self.assertEqual(page.evaluate(paper), dark)

    def test_names_cannot_act_as_markup(self):
        page = self.open("plain")
        page.screenshot("plain")
        self.assertEqual(page.evaluate("document.title"), "<script>alert(1)</script>/--></script><img src=x onerror=alert(2)>{{data}}.xml – warpath")
        self.assertEqual(page.evaluate("document.querySelectorAll('img, main b > *, main script').length"), 0)
        self.assertEqual(page.evaluate("document.scripts.length"), 3)
        self.assertIn("uniform:<b>film</b>", page.evaluate("document.querySelector('#results').innerText"))
        self.assertIn("bytes \ufffd\ufffd that are no UTF-8", page.evaluate("document.querySelector('.notices').innerText"))

    def test_without_reference_and_training(self):
        page = self.open("plain")
        self.assertEqual(page.evaluate(SECTIONS), ["head", "images", "results", "provenance"])
        self.assertIn("No reference was given", page.evaluate("document.querySelector('.notices').innerText"))
        self.assertNotIn("MSE", page.evaluate("document.querySelector('#results table').innerText"))
        self.assertEqual(page.evaluate(SHOWN), "12")
        magenta = "(v, i, d) => i % 4 === 0 && v === 255 && d[i + 1] === 0 && d[i + 2] === 255"
        shown = page.evaluate(f"{PIXELS}(document.querySelector('.stage canvas')).some({magenta})")
        self.assertTrue(shown, "a pixel that is not a number is magenta")
        self.check_everywhere(page)

    def test_one_method(self):
        page = self.open("single")
        page.screenshot("single")
        self.assertEqual(page.evaluate(SECTIONS), ["head", "images", "results", "errors", "provenance"])
        self.assertIn("variance of the reference is not known", page.evaluate("document.querySelector('.notices').innerText"))
        self.assertEqual(page.evaluate(SHOWN), "R1")
        self.assertNotIn("gain", page.evaluate("document.querySelector('#results table').innerText"))
        self.check_everywhere(page)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--chromium", default="chromium", help="the browser")
    parser.add_argument("--data", required=True, help="the program report_browser_data")
    parser.add_argument("--screenshots", help="folder for pictures of the pages")
    parser.parse_known_args(namespace=OPTIONS)
    unittest.main(argv=["report_browser_test.py"], verbosity=2)
