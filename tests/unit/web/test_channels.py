"""A record whose channels have other names: what it holds is told, and the answer serves all computations."""

import math
import re

import numpy as np
import pytest
from tests.unit.record.exports import EXPORTS, MICRONS

from rotordrop import load_machine, look
from rotordrop.machine.simple import EXAMPLES
from rotordrop.record.readers import known_formats

SENSORS = {"NDE_A": "S_NDE_A", "NDE_B": "S_NDE_B", "DE_A": "S_DE_A", "DE_B": "S_DE_B"}


def profile_text():
    return ("[channels]\n" + "".join(f'{name} = "{channel}"\n' for name, channel in SENSORS.items())).encode()


NUMBERS = {name: value for name, value in EXAMPLES.items() if name != "preload"}


@pytest.fixture(scope="module")
def job(served, files):
    number = served.new_job({"record": files["record"]})
    served.order(f"/api/jobs/{number}/numbers", NUMBERS)
    return number


def recorded(path, channels, row):
    """A file of 50 rows with such channels, and with what a function of its number says."""
    rows = [f"{i * 5e-5:.5f};{row(i)}" for i in range(50)]
    path.write_text("\n".join([f"Time [s];{channels}", *rows]) + "\n")
    return path


def test_the_sensors_of_twelve_numbers_find_their_channels(served, job):
    told = served.done(job, "channels")
    held = {one["label"].split("/")[-1] for one in told["channels"] if one["unit"] == "m"}
    assert held == set(SENSORS.values())
    assert [sensor["name"] for sensor in told["sensors"]] == list(SENSORS)
    assert told["missing"] == []
    found = {sensor: label.split("/")[-1] for sensor, label in told["profile"]["channels"].items()}
    assert found == SENSORS
    for role in ("tail", "token", "beside", ".."):  # what was not sent
        assert served.ask("GET", f"/api/jobs/{job}/files/{role}").status == 404


def test_what_a_record_does_not_tell_is_asked(served, tmp_path):
    channels = "VE-1X [mm];VE-1Y [mm];VE-2X [mm];VE-2Y [mm]"
    path = recorded(tmp_path / "drop.csv", channels, lambda _: "0.001;0.001;0.001;0.001")
    number = served.new_job({"record": path})
    served.order(f"/api/jobs/{number}/numbers", NUMBERS)
    assert "has no channel 'NDE_A' for sensor NDE_A" in served.failed(number, "look")
    told = served.done(number, "channels")
    assert "channels of NDE_A, NDE_B, DE_A, DE_B" in told["missing"][0]
    # what the page chooses is what the command line suggests
    suggested = re.findall(r"(VE-\d[XY]) (-?\d+) deg", told["missing"][0])
    angles = {sensor["name"]: f"{math.degrees(sensor['angle']):.0f}" for sensor in told["sensors"]}
    assert sorted((label, angles[name]) for name, label in told["likely"].items()) == sorted(suggested)
    assert "X a quarter turn before Y" in told["likely_by"]


def test_a_page_asks_for_channels_in_words_of_its_own(served, tmp_path):
    channels = "alpha [um];bravo [um];c [um];d [um];speed [rpm]"
    path = recorded(tmp_path / "drop.csv", channels, lambda i: f"0;{i};{i};{3 * i - 49};{i / 10}")
    number = served.new_job({"record": path})
    told = served.failed(number, "look")
    assert told.endswith("say which channel is which") and "--map" not in told
    page = served.done(number, "channels")
    assert page["likely"] == {"NDE": "alpha, bravo", "DE": "c, d"}
    assert page["channels"][-2]["range"] == {"SI": "−49 to 98 µm", "US": "−1.9 to 3.9 mil"}
    assert page["channels"][-1]["range"]["US"] == "0 to 4.9 rpm"


def test_a_shaft_table_that_was_forgotten_is_asked_for_alone(served, files):
    number = served.new_job({role: files[role] for role in ("record", "machine")})
    told = served.failed(number, "look")
    assert "needs the shaft table 'lp400_shaft.csv'; drop that file alone on the page" in told
    sent = served.put(number, "beside", files["beside"].name, files["beside"].read_bytes())
    assert sent.status == 201, sent.text
    served.done(number, "look")


def test_without_a_machine_the_planes_are_guessed_and_a_wav_asks_for_its_full_scale(served, tmp_path):
    wav = next(one for one in EXPORTS if one.form == "WAV")
    number = served.new_job({"record": wav.written(tmp_path)})
    assert "holds shares of a full scale" in served.failed(number, "look")
    told = served.done(number, "channels")
    planes = {"plane 1": "channel 1, channel 2", "plane 2": "channel 3, channel 4"}
    assert told["profile"]["planes"] == planes
    assert {one["unit"] for one in told["channels"]} == {"of full scale"}
    for microns, one in zip(MICRONS.T, told["channels"], strict=True):
        np.testing.assert_allclose(one["trace"], (microns - microns.min()) / np.ptp(microns), atol=2e-3)
    assert 'what full scale is: --full-scale "500 um"' in told["missing"]


def test_the_answer_serves_the_look(served, job, files, tmp_path):
    sent = served.put(job, "profile", "mine.toml", profile_text())
    assert sent.status == 201, sent.text
    page = served.done(job, "look")
    for role, name in (("machine", "twelve_numbers.toml"), ("profile", "mine.toml")):
        (tmp_path / name).write_bytes(served.ask("GET", f"/api/jobs/{job}/files/{role}").body)
    machine, profile = load_machine(tmp_path / "twelve_numbers.toml"), tmp_path / "mine.toml"
    seen = look(files["record"], machine=machine, profile=profile)
    shown = [(one["place"], one["time"], one["azimuth"]) for one in page["impacts"]]
    assert shown == [(one.plane, one.time, one.azimuth) for one in seen.impacts]
    assert len(shown) > 2


def test_planes_named_by_hand_need_no_machine_and_options_that_change_drop_what_was_found(served, files):
    number = served.new_job({"record": files["record"]}, gap="250 um")
    planes = "ONE: S_NDE_A 135 deg, S_NDE_B 45 deg; TWO: S_DE_A 135 deg, S_DE_B 45 deg"
    changed = served.order(f"/api/jobs/{number}/options", {"planes": planes})
    assert changed.told["options"] == {"gap": "250 um", "planes": planes}
    served.done(number, "look")
    assert [plane["plane"] for plane in served.document(number, "look")["planes"]] == ["ONE", "TWO"]
    assert served.order(f"/api/jobs/{number}/options", {"gap": "260 um"}).told["states"] == {}
    assert served.ask("GET", f"/api/jobs/{number}/look/page").status == 404


def test_the_page_states_what_the_readers_read(served):
    assert tuple(served.ask("GET", "/api/formats").told["formats"]) == known_formats()
