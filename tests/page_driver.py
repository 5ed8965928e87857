"""page_driver.py: drive a page of vg-view in headless Chromium, through its debugging pipe, with the standard library only.

Leaves out what a page should show: tests/page.bats says that.
SPDX-License-Identifier: GPL-3.0-or-later
"""
import base64
import json
import os
import pathlib
import select
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zlib

FLAGS = ["--headless=new", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--no-first-run", "--disable-extensions", "--disable-background-networking", "--disable-dev-shm-usage",
         "--remote-debugging-pipe", "--window-size=900,700"]


def find_browser():
    for name in ("chromium", "chromium-browser", "google-chrome"):
        path = shutil.which(name)
        if path:
            return path
    return None


class Page:
    """One page; with Page(path) as page: ... `trouble` collects what the console and the network said."""

    def __init__(self, path, fragment="", seconds=60):
        self.end = time.monotonic() + seconds
        self.address = pathlib.Path(path).resolve().as_uri() + fragment
        self.trouble, self.requests, self.number, self.rest = [], [], 0, b""

    def __enter__(self):
        self.profile = tempfile.mkdtemp()
        theirs_in, self.to = os.pipe()
        self.back, theirs_out = os.pipe()

        def wire():  # the browser reads from descriptor 3 and writes to 4
            a, b = os.dup2(theirs_in, 60), os.dup2(theirs_out, 61)
            os.dup2(a, 3)
            os.dup2(b, 4)
            for fd in (60, 61):
                os.close(fd)

        self.process = subprocess.Popen([find_browser(), *FLAGS, "--user-data-dir=" + self.profile, "about:blank"],
                                        preexec_fn=wire, close_fds=False, start_new_session=True,
                                        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(theirs_in)
        os.close(theirs_out)
        self.session = None
        target = [t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page"][0]
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(domain + ".enable")
        self.call("Emulation.setDeviceMetricsOverride", width=900, height=700, deviceScaleFactor=1, mobile=False)
        self.call("Page.navigate", url=self.address)
        return self

    def __exit__(self, *_):
        try:
            self.session = None
            self.call("Browser.close")
            self.process.wait(10)
        except Exception:
            self.process.kill()
            self.process.wait()
        os.close(self.to)
        os.close(self.back)
        shutil.rmtree(self.profile, ignore_errors=True)

    def receive(self):
        while b"\0" not in self.rest:
            ready, _, _ = select.select([self.back], [], [], max(0, self.end - time.monotonic()))
            data = os.read(self.back, 1 << 16) if ready else b""
            if not data:
                raise RuntimeError("the browser does not answer")
            self.rest += data
        line, self.rest = self.rest.split(b"\0", 1)
        message = json.loads(line)
        method, params = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.trouble.append(params["exceptionDetails"])
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.trouble.append(params["args"])
        elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.trouble.append(params["entry"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])
        return message

    def call(self, method, **params):
        self.number += 1
        number, message = self.number, {"id": self.number, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.receive()
            if answer.get("id") == number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def value(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(str(answer["exceptionDetails"]))
        return answer["result"].get("value")

    def wait(self, expression):
        while not self.value(f"try {{ Boolean({expression}) }} catch (error) {{ false }}"):  # not yet there is not yet true
            if time.monotonic() > self.end:
                raise RuntimeError(f"never true: {expression}; message: {self.value('document.body.innerText')}")
            time.sleep(0.05)

    def loaded(self):
        self.wait("document.documentElement.dataset.whole === 'true' && document.documentElement.dataset.drawn !== undefined")

    def key(self, key, text=None):
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, text=text or (key if len(key) == 1 else ""))
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key)

    def drag(self, x0, y0, x1, y1):
        self.call("Input.dispatchMouseEvent", type="mousePressed", x=x0, y=y0, button="left", buttons=1, clickCount=1)
        for i in range(1, 5):
            self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x0 + (x1 - x0) * i / 4, y=y0 + (y1 - y0) * i / 4,
                      button="left", buttons=1)
        self.call("Input.dispatchMouseEvent", type="mouseReleased", x=x1, y=y1, button="left", clickCount=1)

    def click(self, selector):
        box = self.value(f"(r => [r.x + r.width / 2, r.y + r.height / 2])(document.querySelector({json.dumps(selector)}).getBoundingClientRect())")
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=box[0], y=box[1], button="left", clickCount=1)

    def saved(self, selector, folder="downloads"):
        """Click a button that saves a file: the path of that file."""
        pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
        folder, session = pathlib.Path(tempfile.mkdtemp(dir=folder)).resolve(), self.session  # one of its own: names repeat
        self.session = None
        self.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))
        self.session = session
        self.click(selector)
        while time.monotonic() < self.end:
            new = [f for f in folder.iterdir() if not f.name.endswith(".crdownload") and f.stat().st_size]
            if new:
                return str(new[0])
            time.sleep(0.05)
        raise RuntimeError(f"{selector} saved nothing")

    def settle(self):
        self.value("new Promise(f => requestAnimationFrame(() => requestAnimationFrame(() => f(true))))")

    def picture(self, save=None):
        """The canvas, without the ring of the focus: width, height, rows of RGB bytes."""
        self.value("document.activeElement.blur()")
        self.settle()
        clip = self.value("(r => ({x: r.x, y: r.y, width: r.width, height: r.height, scale: 1}))(document.querySelector('#canvas').getBoundingClientRect())")
        data = base64.b64decode(self.call("Page.captureScreenshot", format="png", clip=clip)["data"])
        if save:
            pathlib.Path(save).write_bytes(data)
        return read_png(data)


def read_png(data):
    at, pixels = 8, b""
    while at < len(data):
        size, tag = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if tag == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
        elif tag == b"IDAT":
            pixels += body
        at += 12 + size
    assert depth == 8 and colour in (2, 6)
    n = 3 if colour == 2 else 4
    raw, rows, before = zlib.decompress(pixels), [], bytearray(width * n)
    for y in range(height):
        start = y * (width * n + 1)
        kind, row = raw[start], bytearray(raw[start + 1:start + 1 + width * n])
        for i in range(len(row)):
            a, b, c = row[i - n] if i >= n else 0, before[i], before[i - n] if i >= n else 0
            if kind == 1:
                row[i] = (row[i] + a) & 255
            elif kind == 2:
                row[i] = (row[i] + b) & 255
            elif kind == 3:
                row[i] = (row[i] + (a + b) // 2) & 255
            elif kind == 4:
                p = a + b - c
                best = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))
                row[i] = (row[i] + best[2]) & 255
        rows.append(bytes(row) if n == 3 else bytes(x for i, x in enumerate(row) if i % 4 != 3))
        before = row
    return width, height, rows


def share_drawn(picture, left=0.0, right=1.0):
    """The share of the pixels between two shares of the width that are not the background (of a row, that at its right end)."""
    width, height, rows = picture
    a, b, other = int(left * width), int(right * width), 0
    for row in rows:
        ground = row[3 * (width - 2):3 * (width - 1)]
        other += sum(max(abs(row[3 * x + k] - ground[k]) for k in range(3)) > 2 for x in range(a, b))
    return other / ((b - a) * height)


if __name__ == "__main__":  # page_driver.py PAGE PICTURE [#FRAGMENT]: a picture of a page
    with Page(sys.argv[1], *sys.argv[3:]) as shown:
        shown.loaded()
        shown.settle()
        pathlib.Path(sys.argv[2]).write_bytes(base64.b64decode(shown.call("Page.captureScreenshot", format="png")["data"]))
        print(shown.trouble or "no trouble")
