"""A record whose channels have other names: what it holds is told, and the answer serves all computations."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from tests.unit.record.exports import EXPORTS, MICRONS

from rotordrop import load_machine, look
from rotordrop.machine.simple import EXAMPLES
from rotordrop.record.profile import Profile, load_profile
from rotordrop.web.python_lines import estimate_lines, look_lines

SENSORS = {"NDE_A": "S_NDE_A", "NDE_B": "S_NDE_B", "DE_A": "S_DE_A", "DE_B": "S_DE_B"}


def export(form: str):
    return next(one for one in EXPORTS if one.form == form)


def profile_text(**speed: str) -> bytes:
    text = "[channels]\n" + "".join(f'{sensor} = "{channel}"\n' for sensor, channel in SENSORS.items())
    return (text + "".join(f'[speed]\n{name} = "{value}"\n' for name, value in speed.items())).encode()


@pytest.fixture(scope="module")
def job(served, files) -> str:
    number = served.new_job({"record": files["record"]})
    served.order(f"/api/jobs/{number}/numbers", {k: v for k, v in EXAMPLES.items() if k != "preload"})
    return str(number)


def test_the_sensors_of_twelve_numbers_find_their_channels(served, job):
    served.order(f"/api/jobs/{job}/channels")
    assert served.settled(job, "channels")["state"] == "done"
    told = served.ask("GET", f"/api/jobs/{job}/channels/page").told
    held = {one["label"].split("/")[-1] for one in told["channels"] if one["unit"] == "m"}
    assert held == set(SENSORS.values())
    assert [sensor["name"] for sensor in told["sensors"]] == list(SENSORS)
    assert told["missing"] == []
    found = {sensor: label.split("/")[-1] for sensor, label in told["profile"]["channels"].items()}
    assert found == SENSORS


def test_what_a_record_does_not_tell_is_asked(served, tmp_path):
    rows = [f"{i * 5e-5:.5f};" + ";".join("0.001" for _ in range(4)) for i in range(50)]
    path = tmp_path / "drop.csv"
    path.write_text("\n".join(["Time [s];VE-1X [mm];VE-1Y [mm];VE-2X [mm];VE-2Y [mm]", *rows]) + "\n")
    number = served.new_job({"record": path})
    served.order(f"/api/jobs/{number}/numbers", {k: v for k, v in EXAMPLES.items() if k != "preload"})
    served.order(f"/api/jobs/{number}/look")
    assert "has no channel 'NDE_A' for sensor NDE_A" in served.settled(number, "look")["error"]
    served.order(f"/api/jobs/{number}/channels")
    assert served.settled(number, "channels")["state"] == "done"
    told = served.ask("GET", f"/api/jobs/{number}/channels/page").told
    assert "channels of NDE_A, NDE_B, DE_A, DE_B" in told["missing"][0]
    # what the page chooses is what the command line suggests
    suggested = re.findall(r"(VE-\d[XY]) (-?\d+) deg", told["missing"][0])
    angles = {sensor["name"]: f"{math.degrees(sensor['angle']):.0f}" for sensor in told["sensors"]}
    assert sorted((label, angles[name]) for name, label in told["likely"].items()) == sorted(suggested)
    assert "X a quarter turn before Y" in told["likely_by"]


def test_a_page_asks_for_channels_in_words_of_its_own(served, tmp_path):
    rows = [f"{i * 5e-5:.5f};0;{i};{i};{3 * i - 49};{i / 10}" for i in range(50)]
    path = tmp_path / "drop.csv"
    path.write_text("\n".join(["Time [s];alpha [um];bravo [um];c [um];d [um];speed [rpm]", *rows]) + "\n")
    number = served.new_job({"record": path})
    served.order(f"/api/jobs/{number}/look")
    told = served.settled(number, "look")["error"]
    assert told.endswith("say which channel is which") and "--map" not in told
    served.order(f"/api/jobs/{number}/channels")
    assert served.settled(number, "channels")["state"] == "done"
    page = served.ask("GET", f"/api/jobs/{number}/channels/page").told
    assert page["likely"] == {"NDE": "alpha, bravo", "DE": "c, d"}
    assert page["channels"][-2]["range"] == {"SI": "−49 to 98 µm", "US": "−1.9 to 3.9 mil"}
    assert page["channels"][-1]["range"]["US"] == "0 to 4.9 rpm"


def test_a_shaft_table_that_was_forgotten_is_asked_for_alone(served, files):
    number = served.new_job({role: files[role] for role in ("record", "machine")})
    served.order(f"/api/jobs/{number}/look")
    told = served.settled(number, "look")["error"]
    assert "needs the shaft table 'lp400_shaft.csv'; drop that file alone on the page" in told
    path = files["beside"]
    sent = served.ask("PUT", f"/api/jobs/{number}/files/beside?name={path.name}", path.read_bytes())
    assert sent.status == 201, sent.text
    served.order(f"/api/jobs/{number}/look")
    assert served.settled(number, "look")["state"] == "done"


def test_without_a_machine_the_planes_are_guessed_and_a_wav_asks_for_its_full_scale(served, tmp_path):
    number = served.new_job({"record": export("WAV").written(tmp_path)})
    served.order(f"/api/jobs/{number}/look")
    assert "holds shares of a full scale" in served.settled(number, "look")["error"]
    served.order(f"/api/jobs/{number}/channels")
    assert served.settled(number, "channels")["state"] == "done"
    told = served.ask("GET", f"/api/jobs/{number}/channels/page").told
    assert told["profile"]["planes"] == {
        "plane 1": "channel 1, channel 2",
        "plane 2": "channel 3, channel 4",
    }
    assert {one["unit"] for one in told["channels"]} == {"of full scale"}
    for column, one in enumerate(told["channels"]):
        shares = (MICRONS[:, column] - MICRONS[:, column].min()) / np.ptp(MICRONS[:, column])
        np.testing.assert_allclose(one["trace"], shares, atol=2e-3)
    assert 'what full scale is: --full-scale "500 um"' in told["missing"]


def test_the_answer_serves_look_and_lines_of_python(served, job, files, tmp_path, monkeypatch):
    sent = served.ask("PUT", f"/api/jobs/{job}/files/profile?name=mine.toml", profile_text())
    assert sent.status == 201, sent.text
    served.order(f"/api/jobs/{job}/look")
    assert served.settled(job, "look")["state"] == "done"
    page = served.ask("GET", f"/api/jobs/{job}/look/page").told
    for role, name in (("machine", "twelve_numbers.toml"), ("profile", "mine.toml")):
        (tmp_path / name).write_bytes(served.ask("GET", f"/api/jobs/{job}/files/{role}").body)
    (tmp_path / "drop_060.h5").write_bytes(files["record"].read_bytes())
    monkeypatch.chdir(tmp_path)
    told: dict[str, object] = {}
    exec(page["python"]["impacts"], told)
    shown = [(one["place"], one["time"], one["azimuth"]) for one in page["impacts"]]
    assert [entry[:3] for entry in told["impacts"]] == shown
    assert len(shown) > 2
    seen = look("drop_060.h5", machine=load_machine("twelve_numbers.toml"), profile="mine.toml")
    np.testing.assert_array_equal([one.time for one in seen.impacts], [one[1] for one in shown])


def test_planes_named_by_hand_need_no_machine(served, files):
    number = served.new_job({"record": files["record"]}, gap="250 um")
    planes = "ONE: S_NDE_A 135 deg, S_NDE_B 45 deg; TWO: S_DE_A 135 deg, S_DE_B 45 deg"
    changed = served.order(f"/api/jobs/{number}/options", {"planes": planes})
    assert changed.told["options"] == {"gap": "250 um", "planes": planes}
    served.order(f"/api/jobs/{number}/look")
    assert served.settled(number, "look")["state"] == "done"
    document = served.ask("GET", f"/api/jobs/{number}/look/document").told
    assert [plane["plane"] for plane in document["planes"]] == ["ONE", "TWO"]
    page = served.ask("GET", f"/api/jobs/{number}/look/page").told
    assert "mapping=['ONE: S_NDE_A 135 deg, S_NDE_B 45 deg', 'TWO: " in page["python"]["overview"]


def test_options_that_change_drop_what_was_found_without_them(served, files):
    number = served.new_job({"record": files["record"]}, gap="250 um")
    served.order(f"/api/jobs/{number}/look")
    served.settled(number, "look")
    assert served.order(f"/api/jobs/{number}/options", {"gap": "260 um"}).told["states"] == {}
    assert served.ask("GET", f"/api/jobs/{number}/look/page").status == 404


def test_a_speed_by_hand_is_in_the_lines_of_python(tmp_path, monkeypatch):
    files = {"machine": {"name": "m.toml"}, "record": {"name": "r.csv"}, "profile": {"name": "p.toml"}}
    (tmp_path / "p.toml").write_bytes(profile_text())
    monkeypatch.chdir(tmp_path)
    for lines in (estimate_lines(files, {"speed": "60 Hz"}, []), look_lines(files, {"speed": "60 Hz"}, 0)):
        text = lines["impacts"]
        head = [line for line in text.split("\n") if "profile" in line and "read_record" not in line]
        told: dict[str, Profile] = {}
        exec("\n".join(line for line in head if "look(" not in line), told)
        assert told["profile"].channels == load_profile("p.toml").channels
        assert told["profile"].speed.constant == "60 Hz"
        assert "profile=profile" in text


def test_a_file_that_was_not_sent_is_not_there(served, job):
    for role in ("tail", "token", "beside", ".."):
        assert served.ask("GET", f"/api/jobs/{job}/files/{role}").status == 404


def test_the_page_states_what_the_readers_read(served):
    from rotordrop.record.readers import known_formats

    assert tuple(served.ask("GET", "/api/formats").told["formats"]) == known_formats()


def test_a_full_disk_leaves_no_history(tmp_path):
    """What does not fit is an error, never a shorter file."""
    import resource
    import subprocess
    import sys

    program = (
        "import resource, sys; from pathlib import Path; import numpy as np, signal;"
        "from rotordrop.web.traces import write_traces; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000));"
        "write_traces(Path(sys.argv[1]), 'drop', np.arange(1e5), {'a': np.zeros(100_000)})"
    )
    assert resource.RLIMIT_FSIZE
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        env={"PYTHONPATH": ":".join(filter(None, sys.path))},
    )
    assert "OutputError" in done.stderr and "drop.time.npy" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_result_of_files_that_were_replaced_does_not_count(served, files):
    from rotordrop.web.running import publish, published_run

    number = served.new_job({"record": files["record"]})
    job = served.space.job(number)
    before, made = job.digests(), Path(job.path / "look.made")
    served.ask("PUT", f"/api/jobs/{number}/files/record?name=a.csv", b"other")
    made.mkdir()
    publish(job, "look", "0" * 16, made, before)
    assert published_run(job, "look") is None
    assert served.ask("GET", f"/api/jobs/{number}/look/page").status == 404
    json.loads((job.path / "look.result.json").read_text())
