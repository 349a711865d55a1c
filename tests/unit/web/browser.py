"""Drive a headless Chromium by its pipe: no driver, no web socket, nothing to install."""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
ALLOWED = "http://127.0.0.1"
QUIET = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--remote-debugging-pipe", "--disable-dev-shm-usage",
    "--disable-default-apps", "--no-default-browser-check", "--hide-scrollbars",
)  # fmt: skip


class Browser:
    """One browser with one page; everything it said or asked for is kept."""

    def __init__(self, profile: Path) -> None:
        here_in, there_out = os.pipe()
        there_in, here_out = os.pipe()
        options = f"{' '.join(QUIET)} --user-data-dir={profile}"
        command = f"exec {CHROMIUM} {options} about:blank 3<&{there_in} 4>&{there_out}"
        self._process = subprocess.Popen(
            ["bash", "-c", command],
            pass_fds=(there_in, there_out),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        os.close(there_in)
        os.close(there_out)
        self._read, self._write, self._rest, self._number = here_in, here_out, b"", 0
        self._session: str | None = None
        self.events: list[dict[str, Any]] = []
        targets = self.call("Target.getTargets")["targetInfos"]
        target = next(one["targetId"] for one in targets if one["type"] == "page")
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")
        self.size(1280, 800)

    def size(self, width: int, height: int) -> None:
        told: dict[str, Any] = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **told)

    def call(self, method: str, timeout: float = 60.0, **parameters: Any) -> dict[str, Any]:
        self._number += 1
        told: dict[str, Any] = {"id": self._number, "method": method, "params": parameters}
        if self._session is not None:
            told["sessionId"] = self._session
        os.write(self._write, json.dumps(told).encode() + b"\0")
        number, until = self._number, time.monotonic() + timeout
        while time.monotonic() < until:
            for answer in self._heard(until - time.monotonic()):
                if answer.get("id") == number:
                    assert "error" not in answer, answer["error"]
                    return answer["result"]
                if "method" in answer:
                    self.events.append(answer)
        raise TimeoutError(method)

    def _heard(self, patience: float) -> list[dict[str, Any]]:
        if select.select([self._read], [], [], max(min(patience, 1.0), 0.0))[0]:
            self._rest += os.read(self._read, 1 << 20)
        *whole, self._rest = self._rest.split(b"\0")
        return [json.loads(one) for one in whole]

    def evaluate(self, expression: str) -> Any:
        found = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def until(self, expression: str, patience: float = 600.0) -> None:
        end = time.monotonic() + patience
        while time.monotonic() < end:
            if self.evaluate(f"Boolean({expression})"):
                return
            time.sleep(0.1)
        said = str(self.evaluate("document.body.innerText"))[:600]
        raise AssertionError(f"never true: {expression}; the page says {said!r}; messages: {self.messages()}")

    def open(self, address: str) -> None:
        self.call("Page.navigate", url=address)
        self.until("document.readyState === 'complete'")

    def key(self, key: str) -> None:
        numbers = {"Tab": 9, "Enter": 13, "Escape": 27, "ArrowLeft": 37, "ArrowRight": 39, " ": 32}
        number = numbers.get(key, ord(key.upper()[0]) if len(key) == 1 else 0)
        typed = "\r" if key == "Enter" else key if len(key) == 1 else ""
        told: dict[str, Any] = {"key": key, "code": key, "windowsVirtualKeyCode": number}
        self.call("Input.dispatchKeyEvent", type="keyDown", **told, **({"text": typed} if typed else {}))
        self.call("Input.dispatchKeyEvent", type="keyUp", **told)

    def choose_files(self, selector: str, files: list[Path]) -> None:
        node = self.call("Runtime.evaluate", expression=f"document.querySelector({selector!r})")["result"][
            "objectId"
        ]
        self.call("DOM.setFileInputFiles", files=[str(file) for file in files], objectId=node)

    def colours(self, scheme: str) -> None:
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def messages(self) -> list[str]:
        """Console, exceptions, and what the browser logs of itself, refused scripts included."""
        said = []
        for event in self.events:
            kind, told = event["method"], event["params"]
            if kind == "Runtime.consoleAPICalled":
                said.append(str([one.get("value", one.get("description")) for one in told["args"]]))
            elif kind == "Runtime.exceptionThrown":
                said.append(str(told["exceptionDetails"].get("exception", told["exceptionDetails"])))
            elif kind == "Log.entryAdded":
                said.append(told["entry"]["text"] + " " + told["entry"].get("url", ""))
        return said

    def foreign(self) -> list[str]:
        """Addresses outside this computer that the page asked for."""
        asked = [
            one["params"]["request"]["url"]
            for one in self.events
            if one["method"] == "Network.requestWillBeSent"
        ]
        return [url for url in asked if not url.startswith((ALLOWED, "blob:", "data:", "about:"))]

    def close(self) -> None:
        self._process.terminate()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
        for descriptor in (self._read, self._write):
            os.close(descriptor)
