"""Headless Chromium for tests of pages, driven through its debugging pipe with the standard library alone."""

import atexit, base64, contextlib, json, os, pathlib, select, shutil, tempfile, time

FLAGS = """--headless=new --no-sandbox --disable-gpu --hide-scrollbars --remote-debugging-pipe --no-startup-window
--force-device-scale-factor=1 --enable-unsafe-swiftshader --no-first-run --no-proxy-server --disable-extensions
--disable-background-networking --disable-breakpad --disable-dev-shm-usage --password-store=basic
--disable-site-isolation-trials --disable-features=BackForwardCache,IsolateSandboxedIframes,MediaRouter""".split()
FLAGS.append("--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE localhost, EXCLUDE 127.0.0.1")  # no other host is found
ATTACH = dict(autoAttach=True, waitForDebuggerOnStart=True, flatten=True, filter=[{"type": "page"}, {"type": "worker"}])
KEYS = {"Backspace": 8, "Tab": 9, "Enter": 13, "Escape": 27, " ": 32, "PageUp": 33, "PageDown": 34, "End": 35}
KEYS |= {"Home": 36, "ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Delete": 46}


def text(value):
    """What the console shows of a value, an exception or an entry."""
    for key in "exceptionDetails", "exception", "entry":
        value = value.get(key, value)
    return f"{value.get('text', value.get('description', value.get('value', 'undefined')))} {value.get('url', '')}".strip()


class Browser(contextlib.ExitStack):
    """A browser with one page, whose `errors` in the console and `requests` (URLs, without the document's) every call
    brings up to date. TimeoutError says what did not come in time, ConnectionError that the browser has ended."""

    def __init__(self, executable=None):
        super().__init__()
        names = executable or os.environ.get("GONIO_BROWSER") or "chromium:chromium-browser:google-chrome"
        if not (path := next(filter(None, map(shutil.which, str(names).split(":"))), None)):
            raise FileNotFoundError(f"no browser {names}: GONIO_BROWSER can name one")
        folder = self.enter_context(tempfile.TemporaryDirectory(prefix="browser-", ignore_cleanup_errors=True))
        self._folder, self._session, self._number, self._out, self._in = folder, "", 0, bytearray(), bytearray()
        self.errors, self.requests, self._document = [], [], None
        (read, self._to), (self._from, written) = os.pipe(), os.pipe()  # written > 3, so that a copy to 3 spares it
        files = [(os.POSIX_SPAWN_DUP2, read, 3), (os.POSIX_SPAWN_DUP2, written, 4)]
        files += [(os.POSIX_SPAWN_OPEN, i, f"{folder}/{i}", os.O_RDWR | os.O_CREAT, 0o600) for i in range(3)]
        command, own = [path, *FLAGS, f"--user-data-dir={folder}/profile"], {"HOME": folder, "TMPDIR": folder}
        with open(read), open(written, "w"):
            process = os.posix_spawn(path, command, os.environ | own, file_actions=files, setpgroup=0)
        for do in (os.close, self._to), (os.close, self._from), (os.waitpid, process, 0), (os.killpg, process, 9):
            self.callback(*do)  # the last one first
        atexit.register(self.close)
        with contextlib.ExitStack() as failed:
            failed.push(self)
            self.call("Target.setAutoAttach", **ATTACH)
            self.call("Target.createTarget", 60, url="about:blank")
            self.size(1280, 800)
            failed.pop_all()

    def _post(self, session, method, number=0, **params):
        self._out += json.dumps({"id": number, "sessionId": session, "method": method, "params": params}).encode() + b"\0"

    def call(self, method, within=20, /, **params):
        """The answer to a method of the protocol, for the page; what comes before it is taken note of."""
        self._number, answer, end = self._number + 1, {}, time.monotonic() + within
        what = f"{method} {params.get('expression') or params.get('url', '')}"[:300].strip()
        self._post(self._session, method, self._number, **params)
        while self._out or not answer:
            come, free, _ = select.select([self._from], [self._to][: len(self._out)], [], max(0, end - time.monotonic()))
            if not come and not free:
                raise TimeoutError(f"{what}: not within {within:.3g} s")
            self._in += (chunk := os.read(self._from, 1 << 16) if come else b"")
            if come and not chunk:
                raise ConnectionError(f"{what}: browser ended: {pathlib.Path(self._folder, '2').read_text()[-500:]}")
            del self._out[: os.write(self._to, self._out[: select.PIPE_BUF]) if free else 0]
            *messages, self._in = self._in.split(b"\0") if b"\0" in chunk else [self._in]
            for message in map(json.loads, messages):
                if message.get("id") == self._number:
                    answer = message
                elif "method" in message:
                    self._note(message["method"], message["params"], message.get("sessionId"))
        if "error" in answer:
            raise RuntimeError(f"{what}: {answer['error']['message']}")
        return answer["result"]

    def _note(self, name, event, session):
        if name == "Runtime.consoleAPICalled" and event["type"] == "error":
            self.errors.append(" ".join(map(text, event["args"])))
        elif name == "Runtime.exceptionThrown" or name == "Log.entryAdded" and event["entry"]["level"] == "error":
            self.errors.append(text(event))
        elif name in ("Network.requestWillBeSent", "Network.webSocketCreated"):
            if session == self._session and event.get("type") == "Document":
                self._document = self._document or event["requestId"]
            if event["requestId"] != self._document:
                self.requests.append(event.get("url") or event["request"]["url"])
        elif name == "Target.attachedToTarget":  # a page or a worker, which waits until all is asked for
            self._session = self._session or event["sessionId"]
            self._post(event["sessionId"], "Target.setAutoAttach", **ATTACH)
            for method in "Page.enable", "Runtime.enable", "Log.enable", "Network.enable", "Runtime.runIfWaitingForDebugger":
                self._post(event["sessionId"], method)
        elif name == "Page.javascriptDialogOpening":
            self._post(session, "Page.handleJavaScriptDialog", accept=True)

    def open(self, url, timeout=20):
        """Opens a page and waits for its load event: the seconds from the start of the navigation to there."""
        end = time.monotonic() + timeout
        for address, sign in ("about:blank#", "=="), (url, "!="):  # a page loads again for another fragment too
            self.errors, self.requests, self._document = [], [], None
            if problem := self.call("Page.navigate", end - time.monotonic(), url=address).get("errorText"):
                raise RuntimeError(f"{address}: {problem}")
            ready = f"{json.dumps(address)} && location {sign} 'about:blank#' && document.readyState == 'complete'"
            self.wait(ready, end - time.monotonic())
        return self.evaluate("performance.getEntriesByType('navigation')[0].loadEventStart / 1000")

    def evaluate(self, expression, timeout=20):
        """The value of an expression, awaited if it is a promise; NaN and the like as text."""
        how = {"expression": expression, "returnByValue": True, "awaitPromise": True, "timeout": 1000 * timeout + 99}
        answer = self.call("Runtime.evaluate", timeout, **how)
        if "exceptionDetails" in answer:
            raise AssertionError(text(answer))
        return answer["result"].get("value", answer["result"].get("unserializableValue"))

    def wait(self, expression, timeout=10):
        """Waits until an expression is true; while it throws, it is not."""
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0:
            with contextlib.suppress(AssertionError, RuntimeError):
                if self.evaluate(f"(async () => !!(await ({expression}\n)))()", left):
                    return
            time.sleep(0.01)
        raise TimeoutError(f"{expression}: not true within {timeout:g} s")

    def size(self, width, height):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def scheme(self, name):
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": name}])

    def move(self, x, y, kind="Moved", **how):
        self.call("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, **how)

    def click(self, x, y):
        self.move(x, y)
        self.drag([(x, y)])

    def drag(self, points, modifiers=0):
        """Presses the main button at the first point, moves to the others and releases it at the last."""
        for kind, (x, y) in [("Pressed", points[0]), *(("Moved", p) for p in points[1:]), ("Released", points[-1])]:
            self.move(x, y, kind, button="left", buttons=int(kind != "Released"), clickCount=1, modifiers=modifiers)

    def touch(self, points):
        """Lays a finger on the first point, moves it to the others and lifts it at the last."""
        for kind, at in [("Start", points[:1]), *(("Move", [p]) for p in points[1:]), ("End", [])]:
            self.call("Input.dispatchTouchEvent", type=f"touch{kind}", touchPoints=[{"x": x, "y": y} for x, y in at])

    def key(self, name, modifiers=0):
        """Presses and releases a key, a character or one of KEYS; modifiers add up: Alt 1, Ctrl 2, Meta 4, Shift 8."""
        code = name.replace(" ", "Space") if name in KEYS else f"{'Digit' if name.isdigit() else 'Key'}{name.upper()}"
        number = KEYS.get(name) or (ord(name.upper()) if name.isalnum() else 0)
        types = "" if modifiers & 7 else "\r" if name == "Enter" else name if len(name) == 1 else ""
        how = {"key": name, "code": code, "windowsVirtualKeyCode": number, "modifiers": modifiers}
        self.call("Input.dispatchKeyEvent", type="keyDown" if types else "rawKeyDown", text=types, **how)
        self.call("Input.dispatchKeyEvent", type="keyUp", **how)

    def drop(self, selector, name, data):
        """Drops a file on an element: whether the page accepts it, without which nobody could drop one there."""
        return self.evaluate(f"""(() => {{ const e = document.querySelector({json.dumps(selector)});
            const dataTransfer = new DataTransfer(), code = "{base64.b64encode(data).decode()}", name = {json.dumps(name)};
            dataTransfer.items.add(new File([Uint8Array.from(atob(code), c => c.charCodeAt(0))], name));
            const event = kind => new DragEvent(kind, {{bubbles: true, cancelable: true, composed: true, dataTransfer}});
            return ["dragenter", "dragover", "drop"].map(kind => !e.dispatchEvent(event(kind)))[1] }})()""")

    def screenshot(self, path, selector=None):
        """Writes a PNG of the viewport, or of a whole element, which is scrolled into view."""
        clip = selector and self.evaluate(f"""(() => {{ const e = document.querySelector({json.dumps(selector)});
            e.scrollIntoView({{block: "center", behavior: "instant"}}); const r = e.getBoundingClientRect();
            const [x, y] = [r.x, r.y].map(Math.floor), [right, bottom] = [r.right, r.bottom].map(Math.ceil);
            return {{x: x + scrollX, y: y + scrollY, width: right - x, height: bottom - y, scale: 1}} }})()""")
        how = {"clip": clip, "captureBeyondViewport": True} if clip else {}
        pathlib.Path(path).write_bytes(base64.b64decode(self.call("Page.captureScreenshot", **how)["data"]))
