"""Measure the page: memory of its server over many analyses, zoom times, records of all formats.

    python studies/page/measure.py memory --records FOLDER   # 50 looks, each with its figures
    python studies/page/measure.py zoom                      # 75 s at 20 kHz, four channels
    python studies/page/measure.py formats --records FOLDER  # every record of a folder, in Chromium

Each writes results/<name>.json beside this file.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT / "src"), str(ROOT)]

from tests.unit.web.browser import Browser
from tests.unit.web.serving import Served

from rotordrop.web.running import publish, write_state
from rotordrop.web.traces import write_traces
from rotordrop.web.workspace import Workspace

EXAMPLES = ROOT / "src" / "rotordrop" / "machine" / "examples"
MACHINE = {"machine": EXAMPLES / "lp400.toml", "beside": EXAMPLES / "lp400_shaft.csv"}
ANALYSES = 50


class Client(Served):
    """Asks a server in a process of its own, whose memory is that of a server alone."""

    def __init__(self, folder: Path) -> None:
        self.space = Workspace(folder)
        told = [sys.executable, "-m", "rotordrop", "serve", "--folder", str(folder), "--port", "0"]
        env = {"PYTHONPATH": str(ROOT / "src"), "PATH": "/usr/bin:/bin", "HOME": str(Path.home())}
        self.process = subprocess.Popen(told, stdout=subprocess.PIPE, text=True, env=env)
        line = self.process.stdout.readline() if self.process.stdout else ""
        self.port = int(line.split("127.0.0.1:")[1].split("/")[0])
        self.token = line.split("token=")[1].strip()

    def memory(self) -> float:
        """Resident memory of the server [MB]."""
        text = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(text.split("VmRSS:")[1].split()[0]) / 1024.0

    def stop(self) -> None:
        self.process.terminate()
        self.process.wait(20)


def memory(records: Path) -> dict[str, object]:
    with tempfile.TemporaryDirectory() as folder:
        server, seen = Client(Path(folder)), []
        try:
            seen.append(server.memory())
            for number in range(ANALYSES):
                record = sorted(records.glob("drop_*60.*"))[number % 4]
                job = server.new_job({**MACHINE, "record": record})
                server.order(f"/api/jobs/{job}/look")
                state = server.settled(job, "look", 300)
                assert state["state"] == "done", state
                page = server.ask("GET", f"/api/jobs/{job}/look/page").told
                columns = "&".join(f"column={name}" for name in page["traces"]["columns"][:6])
                for width in (0.01, 0.1, 1.0, 2.0):
                    server.ask("GET", f"/api/jobs/{job}/look/window?{columns}&start=0&end={width}")
                server.ask("GET", f"/api/jobs/{job}/look/csv?{columns}&start=0&end=0.2")
                server.ask("GET", "/api/drops")
                seen.append(server.memory())
                keep("memory", {"analyses": len(seen) - 1, "MB": [round(one, 1) for one in seen]})
                print(number + 1, f"{seen[-1]:.1f} MB", flush=True)
        finally:
            server.stop()
    return {"analyses": len(seen) - 1, "MB": [round(one, 1) for one in seen]}


def keep(name: str, told: dict[str, object]) -> None:
    (HERE / "results" / f"{name}.json").write_text(json.dumps(told) + "\n", encoding="utf-8")


def zoom() -> dict[str, object]:
    generator = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as folder:
        server = Client(Path(folder))
        try:
            number = server.new_job({})
            job = server.space.job(number)
            assert job is not None
            made, clock = job.path / "look.made", np.arange(75 * 20_000) / 20_000.0
            made.mkdir()
            names = ("x0", "y0", "x1", "y1")
            write_traces(made, "motion", clock, {n: generator.normal(0, 1e-6, len(clock)) for n in names})
            traces = {"name": "motion", "columns": list(names), "start": 0.0, "end": float(clock[-1])}
            (made / "page.json").write_text(json.dumps({"traces": traces}))
            publish(job, "look", "0" * 16, made)
            write_state(job, "look", {"state": "done", "run": "0" * 16})
            taken, most = [], 0
            asked = "&".join(f"column={name}" for name in names)
            for _ in range(200):
                width = 10.0 ** generator.uniform(-2.5, np.log10(75.0))
                start = generator.uniform(0.0, 75.0 - width)
                begun = time.perf_counter()
                body = server.ask(
                    "GET", f"/api/jobs/{number}/look/window?{asked}&start={start}&end={start + width}"
                ).body
                taken.append(1e3 * (time.perf_counter() - begun))
                most = max(most, int(np.frombuffer(body, "<u4", 1, 8)[0]))
        finally:
            server.stop()
    return {
        "windows": len(taken),
        "median_ms": float(np.median(taken)),
        "ninetieth_ms": float(np.quantile(taken, 0.9)),
        "slowest_ms": max(taken),
        "most_points": most,
    }


def formats(records: Path) -> dict[str, object]:
    found = {}
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as profile:
        server, browser = Client(Path(folder)), Browser(Path(profile))
        try:
            browser.open(f"http://127.0.0.1:{server.port}/#token={server.token}")
            for record in sorted(records.glob("*_*.*")):
                if "tail" in record.name:
                    continue
                browser.choose_files("#files", [record, *MACHINE.values()])
                browser.until("document.getElementById('sending').open")
                browser.evaluate("document.getElementById('send').click()")
                browser.until(f"document.getElementById('dropname').innerText === {record.stem!r}", 60)
                job = browser.evaluate("new URLSearchParams(location.hash.slice(1)).get('drop')")
                state = server.settled(job, "look", 300)
                assert state["state"] == "done", (record.name, state)
                browser.until("!/Sending|Looking/.test(document.getElementById('status').innerText)")
                browser.until("document.querySelectorAll('.panel canvas').length >= 2", 60)
                found[record.name] = browser.evaluate("document.getElementById('status').innerText")
                print(record.name, found[record.name], flush=True)
            said, foreign = browser.messages(), browser.foreign()
        finally:
            browser.close()
            server.stop()
    return {"records": found, "console": said, "foreign": foreign}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["memory", "zoom", "formats"])
    parser.add_argument("--records", type=Path)
    given = parser.parse_args()
    told = (
        zoom() if given.what == "zoom" else {"memory": memory, "formats": formats}[given.what](given.records)
    )
    keep(given.what, told)
    print(json.dumps(told, indent=1))


if __name__ == "__main__":
    main()
