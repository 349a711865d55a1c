"""The recipes of docs/watch.md, each run against a real server on this computer.

Usage: python studies/watch/hooks.py

Needs mosquitto, mosquitto_pub and influxd of the system, and paho-mqtt, asyncua and caproto; what is missing
is named and left out. Prints what each server received.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.parse
import urllib.request
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "watch.md"
NEWS = {
    "sha256": "a" * 64,
    "record": "4711 drop, 2.csv",
    "machine": "4711",
    "recorded": "2026-03-14T15:09:26",
    "outcome": "estimated",
    "verdict": "The model is consistent with the record.",
    "needs_person": 'limit "2.5 GPa" passed',
    "speed_Hz": 60.0,
    "bearing": "DE",
    "peak_force_N": 3642.0,
    "peak_force_lower_N": 3549.0,
    "peak_force_upper_N": 3734.0,
    "peak_stress_Pa": 1.859e9,
    "peak_stress_lower_Pa": None,
    "peak_stress_upper_Pa": None,
}


def recipes() -> dict[str, str]:
    """The scripts of the page by name."""
    blocks = re.findall(r"```python\n# (hook_\w+\.py)\n(.*?)```", PAGE.read_text(), re.DOTALL)
    return dict(blocks)


def hooked(command: list[str]) -> None:
    """Run a hook as a watcher does."""
    subprocess.run(command, input=json.dumps(NEWS).encode(), check=True, timeout=60)


def served(command: list[str], ready: Callable[[], bool]) -> subprocess.Popen[bytes]:
    """A server that answers."""
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    until = time.monotonic() + 30.0
    while time.monotonic() < until:
        try:
            if ready():
                return server
        except OSError:
            pass
        time.sleep(0.3)
    server.terminate()
    raise SystemExit(f"{command[0]} does not answer")


def listens(port: int) -> bool:
    """Whether somebody answers."""
    import socket

    with socket.create_connection(("localhost", port), 1.0):
        return True


def mqtt(folder: Path) -> None:
    """Both recipes for MQTT against mosquitto."""
    (folder / "m.conf").write_text("listener 1883 localhost\nallow_anonymous true\n")
    server = served(["mosquitto", "-c", str(folder / "m.conf")], lambda: listens(1883))
    try:
        heard = subprocess.Popen(
            ["mosquitto_sub", "-h", "localhost", "-t", "rotordrop/#", "-v", "-C", "2", "-W", "20"],
            stdout=subprocess.PIPE,
        )
        time.sleep(4.0)
        hooked(["mosquitto_pub", "-h", "localhost", "-t", "rotordrop/drops", "-q", "1", "-s"])
        hooked([sys.executable, str(folder / "hook_mqtt.py")])
        for line in heard.communicate()[0].decode().splitlines():
            topic, _, text = line.partition(" ")
            print(f"MQTT {topic}: equal to what was sent: {json.loads(text) == NEWS}")
    finally:
        server.terminate()


def influx(folder: Path) -> None:
    """Line protocol against InfluxDB 1."""
    configuration = folder / "influx.conf"
    configuration.write_text(
        f'reporting-disabled = true\nbind-address = "127.0.0.1:8088"\n[meta]\ndir = "{folder}/meta"\n'
        f'[data]\ndir = "{folder}/data"\nwal-dir = "{folder}/wal"\n[http]\nbind-address = "127.0.0.1:8086"\n'
    )

    def query(text: str) -> dict:
        body = urllib.parse.urlencode({"q": text, "db": "drops"}).encode()
        with urllib.request.urlopen("http://localhost:8086/query", body) as answer:
            return json.load(answer)

    server = served(["influxd", "-config", str(configuration)], lambda: bool(query("CREATE DATABASE drops")))
    try:
        for _ in range(2):  # a record that is reported twice
            hooked([sys.executable, str(folder / "hook_influx.py")])
        series = query("SELECT * FROM rotor_drop")["results"][0]["series"][0]
        rows = [dict(zip(series["columns"], row, strict=True)) for row in series["values"]]
        print(f"Influx: {len(rows)} point after two calls: {rows[0]}")
    finally:
        server.terminate()


OPC_UA = """
import asyncio
from asyncua import Server
async def main():
    server = Server(); await server.init(); server.set_endpoint("opc.tcp://localhost:4840/")
    space = await server.register_namespace("urn:rotordrop")
    drops = await server.nodes.objects.add_object(space, "Drops")
    one = await drops.add_object(space, "4711")
    for name in {names!r}:
        await (await one.add_variable(space, name, 0.0)).set_writable()
    async with server:
        await asyncio.sleep(60)
asyncio.run(main())
"""


def opc_ua(folder: Path) -> None:
    """The recipe for OPC UA against a server of asyncua."""
    from asyncua.sync import Client

    names = [name for name, value in NEWS.items() if isinstance(value, float)]
    server = served([sys.executable, "-c", OPC_UA.format(names=names)], lambda: listens(4840))
    try:
        hooked([sys.executable, str(folder / "hook_opcua.py")])
        with Client("opc.tcp://localhost:4840/") as client:
            space = client.get_namespace_index("urn:rotordrop")
            node = client.nodes.objects.get_child([f"{space}:Drops", f"{space}:4711"])
            found = {name: node.get_child(f"{space}:{name}").read_value() for name in names}
        print(f"OPC UA: equal to what was sent: {found == {name: NEWS[name] for name in names}}")
    finally:
        server.terminate()


EPICS = """
from caproto.server import PVGroup, pvproperty, run
class Drop(PVGroup):
    numbers = pvproperty(name="NUMBERS", value=[0.0] * 7)
run(Drop(prefix="DROP:4711:").pvdb, interfaces=["127.0.0.1"])
"""


def epics(folder: Path) -> None:
    """The recipe for EPICS against a soft input-output controller of caproto."""
    from caproto.sync.client import read

    server = subprocess.Popen(
        [sys.executable, "-c", EPICS], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        time.sleep(4.0)
        hooked([sys.executable, str(folder / "hook_epics.py")])
        found = read("DROP:4711:NUMBERS", timeout=5, repeater=False).data
        print(f"EPICS: waveform {[float(number) for number in found]}")
    finally:
        server.terminate()


def main() -> None:
    """Try each recipe whose parts are here."""
    needed = {
        mqtt: (("mosquitto", "mosquitto_pub"), ("paho",)),
        influx: (("influxd",), ()),
        opc_ua: ((), ("asyncua",)),
        epics: ((), ("caproto",)),
    }
    with tempfile.TemporaryDirectory() as place:
        for name, text in recipes().items():
            (Path(place) / name).write_text(text)
        for tried, (programs, packages) in needed.items():
            missing = [name for name in programs if shutil.which(name) is None]
            missing += [name for name in packages if find_spec(name) is None]
            if missing:
                print(f"{tried.__name__}: not tried, {', '.join(missing)} is missing")
                continue
            tried(Path(place))


if __name__ == "__main__":
    main()
