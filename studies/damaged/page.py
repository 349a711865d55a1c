"""Attack the page: requests of strangers, half uploads, bombs, slow connections, two servers, damage, kills.

Usage: python studies/damaged/page.py [SEED] [ATTACK...]    all attacks, or those named

The server is a process of its own, as ``rotordrop serve`` starts it. Told is what each attack could do; one
line of ``results/page.jsonl`` for each.
"""

from __future__ import annotations

import gzip
import hashlib
import http.client
import json
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import zipfile
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parent / "results" / "page.jsonl"
WAIT_S = 120.0
ROWS = "Time [s],S_NDE_A [um],S_NDE_B [um],S_DE_A [um],S_DE_B [um]\n" + "".join(
    f"{k * 2e-4:.4f},{k % 7},{k % 5},{k % 3},{k % 11}\n" for k in range(500)
)


class Server:
    """A server of the page on a folder, and what may be asked of it."""

    def __init__(self, folder: Path) -> None:
        words = [sys.executable, "-u", "-m", "rotordrop", "serve", "--port", "0", "--folder", str(folder)]
        self.folder = folder
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if found := re.search(r"http://127\.0\.0\.1:(\d+)/#token=([\w-]+)", line):
                self.port, self.token = int(found[1]), found[2]
                break
        else:
            raise SystemExit("the server did not start")
        self.said: list[str] = []
        threading.Thread(target=lambda: self.said.extend(self.process.stdout or ()), daemon=True).start()

    def head(self) -> dict[str, str]:
        """Headers of the page's own requests."""
        return {"Host": f"127.0.0.1:{self.port}", "X-Rotordrop-Token": self.token}

    def ask(
        self, method: str, path: str, body: bytes | None = None, head: dict[str, str] | None = None
    ) -> tuple[int, bytes]:
        """Status and body of an answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=WAIT_S)
        try:
            connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for name, value in (self.head() if head is None else head).items():
                connection.putheader(name, value)
            if body is not None:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body)
            answer = connection.getresponse()
            return answer.status, answer.read()
        finally:
            connection.close()

    def job(self) -> str:
        """A new job."""
        return str(json.loads(self.ask("POST", "/api/jobs", b'{"name": "a"}')[1])["id"])

    def send(self, job: str, content: bytes, role: str = "record", name: str = "a.csv") -> int:
        """Status of an upload."""
        return self.ask("PUT", f"/api/jobs/{job}/files/{role}?name={name}", content)[0]

    def looked(self, job: str) -> dict[str, Any]:
        """State of a look once it has ended."""
        self.ask("POST", f"/api/jobs/{job}/look", b'{"gap": "250 um", "speed": "60 Hz"}')
        until = time.monotonic() + WAIT_S
        while time.monotonic() < until:
            state = json.loads(self.ask("GET", f"/api/jobs/{job}")[1])["states"].get("look", {})
            if state.get("state") not in ("waiting", "running"):
                return dict(state)
            time.sleep(0.2)
        return {"state": "never ended"}

    def kill(self) -> None:
        """End it at once."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def raw(self, content: bytes) -> socket.socket:
        """A connection on which these bytes were sent."""
        made = socket.create_connection(("127.0.0.1", self.port), timeout=WAIT_S)
        made.sendall(content)
        return made


def strangers(server: Server, dice: random.Random) -> dict[str, Any]:
    """Requests with a foreign host, origin, site or token, on every kind of address."""
    job, own = server.job(), server.head()
    hosts = [
        "evil.example",
        "127.0.0.1",
        f"127.0.0.2:{server.port}",
        "",
        "localhost.evil",
    ]
    heads = [{**own, "Host": host} for host in hosts]
    heads += [{**own, "Origin": origin} for origin in ("http://evil.example", "null", "https://127.0.0.1")]
    heads += [{**own, "Sec-Fetch-Site": site} for site in ("cross-site", "same-site")]
    heads += [
        {**own, "X-Rotordrop-Token": token}
        for token in ("", "x" * 43, server.token[:-1], server.token.upper())
    ]
    heads += [{"Host": own["Host"]}]
    asked = [
        ("GET", "/api/jobs"),
        ("POST", "/api/jobs"),
        ("GET", f"/api/jobs/{job}"),
        ("DELETE", f"/api/jobs/{job}"),
    ]
    asked += [("PUT", f"/api/jobs/{job}/files/record?name=a.csv"), ("POST", f"/api/jobs/{job}/look")]
    counted = Counter(
        server.ask(method, path, b"{}" if method != "GET" else None, head)[0] // 100
        for head in heads
        for method, path in asked
    )
    return {"requests": sum(counted.values()), "let through": counted[2], "5xx": counted[5]}


def traversal(server: Server, dice: random.Random) -> dict[str, Any]:
    """Addresses and names that lead elsewhere: answers are of the page, what is stored lies in a job."""
    parts = [
        "..",
        "%2e%2e",
        "..%2f..",
        "....//",
        "%00",
        "..\\\\",
        "/etc/passwd",
        "%c0%ae%c0%ae",
        "\u202egnp.exe",
    ]
    job, answered = server.job(), Counter[int]()
    odd = []
    for _ in range(200):
        words = "/".join(dice.choice(parts) for _ in range(dice.randint(1, 4)))
        quoted = "".join(c if c.isascii() and c > " " else f"%{ord(c) % 256:02x}" for c in words)
        path = dice.choice(
            [f"/static/{quoted}", f"/api/jobs/{quoted}", f"/api/jobs/{job}/files/{quoted}", f"/{quoted}"]
        )
        status, body = server.ask("GET", path)
        answered[status // 100] += 1
        if (status == 200 and b"root:" in body) or status >= 500:
            odd.append(path)
        server.ask("PUT", f"/api/jobs/{job}/files/{dice.choice(['record', 'beside'])}?name={quoted}", b"x")
    outside = [
        p
        for p in server.folder.rglob("*")
        if p.is_file() and p.parent.name != "files" and p.suffix != ".json"
    ]
    names = sorted(p.name for p in outside if p.name not in ("token", "jobs have digests"))
    return {"answers": dict(answered), "odd": odd, "stored elsewhere": names}


def half(server: Server, dice: random.Random) -> dict[str, Any]:
    """Uploads that are broken off: what was there stays, nothing else is left."""
    job = server.job()
    server.send(job, ROWS.encode())
    before = server.ask("GET", f"/api/jobs/{job}/files/record")[1]
    head = "".join(f"{name}: {value}\r\n" for name, value in server.head().items())
    for k in range(40):
        put = f"PUT /api/jobs/{job}/files/record?name=b.csv HTTP/1.1\r\n{head}"
        coded = (
            "Transfer-Encoding: chunked\r\n\r\nFF\r\nxx"
            if k % 4 == 3
            else "Content-Length: 90000\r\n\r\n" + "x" * 900
        )
        made = server.raw((put + coded).encode())
        if k % 4 == 1:
            made.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")  # reset
        if k % 4 == 2:
            made.shutdown(socket.SHUT_WR)
        time.sleep(dice.uniform(0.0, 0.05))
        made.close()
    time.sleep(2.0)
    left = [p.name for p in (server.folder / "jobs" / job / "files").iterdir()]
    return {
        "uploads": 40,
        "left": left,
        "kept": server.ask("GET", f"/api/jobs/{job}/files/record")[1] == before,
    }


def bombs(server: Server, dice: random.Random) -> dict[str, Any]:
    """Small files that become large: refused, and how long that takes."""
    made: dict[str, bytes] = {"a.csv.gz": gzip.compress(bytes(250 * 2**20), 1)}
    made["b.csv"] = ("," * 1_000_000 + "\n1\n").encode()
    with tempfile.TemporaryDirectory() as folder:
        with zipfile.ZipFile(Path(folder) / "z", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("t.npy", bytes(200 * 2**20))
        made["c.npz"] = (Path(folder) / "z").read_bytes()
    shape = b"{'descr': '<f8', 'fortran_order': False, 'shape': (9999999999,), }"
    made["d.npy"] = b"\x93NUMPY\x01\x00" + len(shape).to_bytes(2, "little") + shape
    told = {}
    for name, content in made.items():
        job = server.job()
        begun = time.monotonic()
        status = server.send(job, content, name=name)
        state = server.looked(job) if status == 201 else {"state": f"refused with {status}"}
        told[name] = f"{state['state']} in {time.monotonic() - begun:.1f} s"
    return told


def slow(server: Server, dice: random.Random) -> dict[str, Any]:
    """50 connections whose head never ends: how many are open after 40 s, and how long others wait."""
    said = [b"", b"GET / HTTP/1.1\r\n", b"GET /api/jobs HTTP/1.1\r\nHost: x\r\nX-A: ", b"G"]
    held = [server.raw(said[k % 4]) for k in range(50)]
    waited = []
    until = time.monotonic() + 40.0
    while time.monotonic() < until:
        begun = time.monotonic()
        server.ask("GET", "/api/jobs")
        waited.append(time.monotonic() - begun)
        time.sleep(0.5)
    alive = 0
    for one in held:
        one.settimeout(0.2)
        try:
            alive += one.recv(1) != b""
        except TimeoutError:
            alive += 1
        except OSError:
            pass
    return {"connections": 50, "open after 40 s": alive, "longest wait of others [s]": round(max(waited), 2)}


def two_servers(server: Server, dice: random.Random) -> dict[str, Any]:
    """A second server on the folder while the first one takes an upload."""
    job, content = server.job(), ROWS.encode()
    head = "".join(f"{name}: {value}\r\n" for name, value in server.head().items())
    put = f"PUT /api/jobs/{job}/files/record?name=b.csv HTTP/1.1\r\n{head}"
    first = server.raw(f"{put}Content-Length: {len(content)}\r\n\r\n".encode() + content[:3000])
    time.sleep(0.5)
    second = Server(server.folder)
    first.sendall(content[3000:])
    answer = first.recv(12)
    second.kill()
    kept = server.ask("GET", f"/api/jobs/{job}/files/record")
    return {"answer": answer.decode(), "whole": kept == (200, content)}


def damage(server: Server, dice: random.Random) -> dict[str, Any]:
    """One damaged job among three, on the page that runs and on one started anew."""
    jobs = [server.job() for _ in range(3)]
    (server.folder / "jobs" / jobs[0] / "job.json").write_text('{"name": ')
    (server.folder / "jobs" / jobs[1] / "look.state.json").write_text("[1")
    listed = server.ask("GET", "/api/jobs")[0]
    server.kill()
    try:
        again = Server(server.folder)
    except SystemExit:
        return {"list": listed, "starts again": False}
    removed = [again.ask("DELETE", f"/api/jobs/{job}")[0] for job in jobs]
    again.kill()
    return {"list": listed, "starts again": True, "removed": removed}


def kills(server: Server, dice: random.Random) -> dict[str, Any]:
    """30 servers killed while they take an upload or make, remove and read jobs; the next one goes on."""
    job = server.job()
    server.send(job, ROWS.encode())
    digest = hashlib.sha256(server.ask("GET", f"/api/jobs/{job}/files/record")[1]).hexdigest()
    changed, half_files = 0, 0
    for _ in range(30):
        stop = threading.Event()

        def work(served: Server = server, stop: threading.Event = stop) -> None:
            while not stop.is_set():
                with suppress(OSError, http.client.HTTPException, ValueError, KeyError):
                    mine = served.job()
                    served.send(mine, ROWS.encode() * 20)
                    served.ask("DELETE", f"/api/jobs/{mine}")

        workers = [threading.Thread(target=work, daemon=True) for _ in range(3)]
        for worker in workers:
            worker.start()
        time.sleep(dice.uniform(0.05, 0.6))
        server.kill()
        stop.set()
        for worker in workers:
            worker.join()
        server = Server(server.folder)
        changed += hashlib.sha256(server.ask("GET", f"/api/jobs/{job}/files/record")[1]).hexdigest() != digest
        half_files += sum(1 for path in server.folder.rglob(".*part*"))
        for one in json.loads(server.ask("GET", "/api/jobs")[1])["jobs"]:
            if one["id"] != job:
                server.ask("DELETE", f"/api/jobs/{one['id']}")
    empty = [p for p in (server.folder / "jobs").iterdir() if p.name != job]
    server.kill()
    return {"kills": 30, "changed": changed, "half files": half_files, "folders left": len(empty)}


def races(server: Server, dice: random.Random) -> dict[str, Any]:
    """Six clients do everything at once for 20 s."""
    counted: Counter[int] = Counter()
    until = time.monotonic() + 20.0

    def work(seed: int) -> None:
        mine = random.Random(seed)
        while time.monotonic() < until:
            with suppress(OSError, http.client.HTTPException):
                jobs = [one["id"] for one in json.loads(server.ask("GET", "/api/jobs")[1]).get("jobs", [])]
                job = mine.choice(jobs or ["0" * 16])
                method, path, body = mine.choice(
                    [
                        ("POST", "/api/jobs", b"{}"),
                        ("PUT", f"/api/jobs/{job}/files/record?name=a.csv", ROWS.encode()),
                        ("POST", f"/api/jobs/{job}/options", b'{"gap": "250 um"}'),
                        ("POST", f"/api/jobs/{job}/look", b"{}"),
                        ("POST", f"/api/jobs/{job}/look/cancel", b"{}"),
                        ("DELETE", f"/api/jobs/{job}", None),
                        ("GET", f"/api/jobs/{job}/files/record", None),
                    ]
                )
                counted[server.ask(method, path, body)[0] // 100] += 1

    workers = [threading.Thread(target=work, args=(dice.randrange(2**32),)) for _ in range(6)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    return {"answers": {f"{kind}xx": n for kind, n in sorted(counted.items())}}


ATTACKS: dict[str, Callable[[Server, random.Random], dict[str, Any]]] = {
    one.__name__: one for one in (strangers, traversal, half, bombs, slow, two_servers, damage, kills, races)
}


def main() -> None:
    """Run the attacks that were named, each on a folder of its own."""
    seed = int(sys.argv[1]) if len(sys.argv) > 1 else 26
    RESULTS.parent.mkdir(exist_ok=True)
    for name in sys.argv[2:] or ATTACKS:
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            server = Server(Path(folder))
            begun = time.monotonic()
            told = ATTACKS[name](server, random.Random(f"{seed} {name}"))
            tracebacks = sum("Traceback" in line for line in server.said)
            server.kill()
        line = {"attack": name, "seed": seed, **told, "tracebacks": tracebacks}
        line["took [s]"] = round(time.monotonic() - begun, 1)
        print(json.dumps(line), flush=True)
        with RESULTS.open("a") as out:
            out.write(json.dumps(line) + "\n")


if __name__ == "__main__":
    main()
