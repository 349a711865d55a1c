"""Channels find their sensors, by name or map, and their units."""

import re
from ast import literal_eval
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import RecordError, UsageError
from rotordrop.evidence.unsaid import guess_profile
from rotordrop.examples import example_record_path
from rotordrop.record.arrangement import arrangement_of
from rotordrop.record.profile import Profile, SpeedSource, load_profile, rules_of, save_profile
from rotordrop.record.record import read_record, record_of, save_record
from rotordrop.record.recording import Channel, Recording

TIME = np.arange(10) * 1e-4


def channel(name, unit="um", values=None, label=None):
    return Channel(
        name=name,
        label=label or name,
        unit=unit,
        values=np.arange(10.0) if values is None else values,
        time=TIME,
    )


def recording(*names, unit="um", extra=()):
    return Recording(channels=(*(channel(name, unit) for name in names), *extra))


def numbered(*names):
    """Channels each of which reads its number."""
    channels = [channel(name, values=np.full(10, float(k))) for k, name in enumerate(names)]
    return Recording(channels=tuple(channels))


SENSORS = ("S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B")


def test_a_sensor_takes_the_channel_of_its_name_or_place(machine):
    record = record_of(recording("s-nde-a", "S NDE B", "sDEa", "S_DE_B"), machine.sensors)
    assert record.signals.shape == (10, 4)
    rules = rules_of(None, ["NDE: CH1, CH0", "DE: CH2, CH3"])
    record = record_of(numbered("CH0", "CH1", "CH2", "CH3"), machine.sensors, profile=rules)
    np.testing.assert_allclose(record.signals[0], [1e-6, 0.0, 2e-6, 3e-6])
    plain = tuple(s.model_copy(update={"name": s.name.removeprefix("S_")}) for s in machine.sensors)
    for names in (SENSORS, [f"Ch{k}: {name}" for k, name in enumerate(SENSORS, start=1)]):
        assert record_of(recording(*names), plain).channel_names == ("NDE_A", "NDE_B", "DE_A", "DE_B")


def test_likely_channels_of_an_end_with_two_planes(machine):
    first, second, *others = machine.sensors
    near = [one.model_copy(update={"name": f"{one.name}2", "node": 9}) for one in (first, second)]
    said = numbered("V-1X", "V-1Y", "V-2X", "V-2Y", "V-3X", "V-3Y")
    found = record_of(said, (first, second, *near, *others), profile=Profile(likely=True))
    assert sorted(1e6 * found.signals[0]) == pytest.approx(range(6))


WHOLE, OTHER = recording(*SENSORS), recording(*SENSORS[:3], "S_DE_C")
TWICE = Recording(channels=tuple(channel(n, label=f"{g}/{n}") for g in "ab" for n in SENSORS))
BARE, ROAD = (recording(*SENSORS, extra=(channel("Speed", unit),)) for unit in ("", "km/h"))
SPEEDS = recording(
    *SENSORS, extra=(channel("N1", "rpm", np.full(10, 3600.0)), channel("N2", "Hz", np.full(10, 50.0)))
)
REFUSED = [
    (OTHER, {}, r"no channel 'S_DE_B' for sensor S_DE_B \(did you mean 'S_NDE_B'\?\); it has S_"),
    (WHOLE, {"channels": {"S_XX": "c"}}, r"names a sensor 'S_XX'; the machine has S_NDE_A, S_NDE_B"),
    (WHOLE, {"channels": {"S_NDE_B": "S_NDE_A"}}, r"'S_NDE_A' is mapped to two sensors, .* S_NDE_B"),
    (TWICE, {}, r"sensor S_NDE_A fits the channels 'a/S_NDE_A', 'b/S_NDE_A'"),
    (recording(*SENSORS, unit=""), {}, r"channel 'S_NDE_A' has no unit; name it in the profile"),
    (BARE, {}, r"the speed channel 'Speed' has no unit"),
    (ROAD, {}, r"the speed channel 'Speed' is in 'km/h'; expected Hz, rpm or rad/s"),
    (SPEEDS, {}, r"'N1', 'N2' could all be the shaft speed"),
    (SPEEDS, {"speed": SpeedSource(channel="N3")}, r"no speed channel 'N3'; it has S_NDE_A"),
]


@pytest.mark.parametrize(("given", "rules", "said"), REFUSED, ids=[said for *_, said in REFUSED])
def test_channels_that_do_not_fit_the_sensors_are_named(given, rules, said, machine):
    with pytest.raises(RecordError, match=said):
        record_of(given, machine.sensors, profile=Profile(**rules))


def test_a_unit_that_is_missing_is_taken_from_the_profile_and_sensors_must_be_there(machine):
    record = record_of(recording(*SENSORS, unit=""), machine.sensors, profile=Profile(unit="mil"))
    np.testing.assert_allclose(record.signals[1], 25.4e-6)
    blind = tuple(sensor.model_copy(update={"sensitivity": None}) for sensor in machine.sensors)
    record = record_of(recording(*SENSORS, unit="mV"), blind, profile=Profile(sensitivity="4 mV/um"))
    np.testing.assert_allclose(record.signals[1], 0.25e-6)
    with pytest.raises(RecordError, match=r"'S_NDE_A' is in volts and neither .* --sensitivity \"8 mV/um"):
        record_of(recording(*SENSORS, unit="V"), blind)
    with pytest.raises(RecordError, match="the machine has no sensors"):
        record_of(recording(*SENSORS), ())


def test_a_speed_channel_is_found_or_chosen(machine):
    for extra in (channel("N", "rpm", np.full(10, 3600.0)), channel("Drehzahl", "Hz", np.full(10, 60.0))):
        record = record_of(recording(*SENSORS, extra=(extra,)), machine.sensors)
        np.testing.assert_allclose(record.speed, 120 * np.pi)
    record = record_of(SPEEDS, machine.sensors, profile=Profile(speed=SpeedSource(channel="N2")))
    np.testing.assert_allclose(record.speed, 100 * np.pi)


def test_a_profile_is_read_back_and_given_by_path(tmp_path, machine):
    profile = Profile(
        channels={"S_NDE_A": "ch 1"},
        unit="um",
        sensitivity="8 mV/um",
        speed=SpeedSource(channel="N", unit="rpm"),
    )
    save_profile(profile, tmp_path / "recorder.toml")
    assert load_profile(tmp_path / "recorder.toml") == profile
    path = tmp_path / "recorder.toml"
    path.write_text('[speed]\nconstant = "61 Hz"\n')
    record = read_record(example_record_path("lp400_drop_060"), machine, profile=path)
    assert record.speed[0] == pytest.approx(122 * np.pi)


def test_a_record_is_read_back_and_refuses_what_it_does_not_hold(drop, machine, tmp_path):
    save_record(drop, tmp_path / "copy.h5")
    copy = read_record(tmp_path / "copy.h5", machine)
    np.testing.assert_array_equal(copy.signals, drop.signals)
    np.testing.assert_allclose(copy.time, drop.time, rtol=0, atol=1e-12)
    np.testing.assert_allclose(copy.speed_readings, drop.speed_readings, rtol=1e-12)
    assert copy.metadata["source"] == "drop_060.h5"
    assert copy.metadata["source_sha256"] == drop.sha256
    assert len(drop.sha256) == 64
    with pytest.raises(RecordError, match=r"reaches from -0.25 s to 0.3 s; nothing lies between 5 s and 6 s"):
        drop.window(5.0, 6.0)
    with pytest.raises(RecordError, match=r"no channel 'S_X'; it has S_NDE_A"):
        drop.reading("S_X")
    np.testing.assert_array_equal(drop.reading("S_DE_B"), drop.signals[:, 3])
    with pytest.raises(ValueError, match="read-only"):
        drop.signals[0, 0] = 0.0
    with pytest.raises(UsageError, match=r"no example recording 'paper_drop'; there are lp400_drop_060"):
        example_record_path("paper_drop")


API = ("Ch1 VE-101X", "Ch2 VE-101Y", "Ch3 VE-102X", "Ch4 VE-102Y")


@pytest.mark.parametrize(
    ("mapping", "read"),
    [
        (("NDE: Ch1 VE-101X, VE-101Y", "DE: VE-102X, VE-102Y"), (1.0, 0.0, 3.0, 2.0)),
        (("nde: VE-101X 135 deg, VE-101Y 45 deg", "DE: VE-102Y 45 deg, VE-102X 135°"), (0.0, 1.0, 2.0, 3.0)),
        (("S_NDE_A = VE-101X", "S_NDE_B=Ch2 VE-101Y", "DE: VE-102X, VE-102Y"), (0.0, 1.0, 3.0, 2.0)),
    ],
)
def test_a_map_names_planes_or_sensors(mapping, read, machine):
    record = record_of(numbered(*API), machine.sensors, profile=rules_of(None, mapping))
    np.testing.assert_allclose(record.signals[0], 1e-6 * np.array(read))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("NDE: VE-101X 0 deg, VE-101Y 90 deg", r"VE-101X at 0 deg is none of the sensors .*S_NDE_A at 135"),
        ("middle: VE-101X, VE-101Y", r"'middle' names 2 channels; the machine has the planes NDE, DE"),
        ("NDE: VE-101X, VE-101Z", r"there is no channel 'VE-101Z'.*there are Ch1 VE-101X, Ch2 VE-101Y"),
        ("NDE VE-101X", r"is neither \"SENSOR=CHANNEL\" nor \"PLANE: CHANNEL"),
        ("NDE: VE-101X, VE-101X", r"VE-101X was named before; every channel is of one sensor"),
    ],
)
def test_a_map_that_does_not_fit_says_why(text, said, machine):
    with pytest.raises(UsageError, match=said):
        record_of(recording(*API), machine.sensors, profile=rules_of(None, [text]))


def test_channels_without_the_names_of_sensors_are_asked_with_the_likeliest_answer(machine):
    """Y stands a quarter turn behind X: the sensors at 135 and 45° were to be X and Y, in this order.

    The same map without its angles seats the channels as the suggestion does, in either order.
    """
    with pytest.raises(RecordError, match="likeliest") as asked:
        record_of(recording(*API), machine.sensors)
    given = literal_eval(str(asked.value).split("mapping=")[1].split(" (planes")[0])
    assert given == [
        "NDE: Ch1 VE-101X 45 deg, Ch2 VE-101Y 135 deg",
        "DE: Ch3 VE-102X 45 deg, Ch4 VE-102Y 135 deg",
    ]
    bare = [re.sub(r" \d+ deg", "", text) for text in given]
    swapped = [re.sub(r": (.+), (.+)", r": \2, \1", text) for text in bare]
    for planes in (given, bare, swapped):
        record = record_of(numbered(*API), machine.sensors, profile=rules_of(None, planes))
        np.testing.assert_allclose(record.signals[0], [1e-6, 0.0, 3e-6, 2e-6])


@pytest.mark.parametrize("axes", ["XY", "HV", "LR", "AB"])
def test_letters_of_the_sensors_seat_the_channels_whatever_their_angles(axes, machine):
    """The first letter stands at 135 and the other at 45°; the letters of the machine decide."""
    swap = {"A": axes[0], "B": axes[1]}
    sensors = tuple(s.model_copy(update={"name": s.name[:-1] + swap[s.name[-1]]}) for s in machine.sensors)
    said = numbered(*(f"VE-41{plane}{axis}" for plane in (11, 12) for axis in axes[::-1]))
    maps = ["NDE: VE-4111{0}, VE-4111{1}", "DE: VE-4112{1}, VE-4112{0}"]
    named = rules_of(None, [text.format(*axes) for text in maps])
    for rules in (Profile(likely=True), named, guess_profile(said, Profile(likely=True), sensors).profile):
        found = record_of(said, sensors, profile=rules)
        np.testing.assert_allclose(found.signals[0], [1e-6, 0.0, 3e-6, 2e-6])


@pytest.mark.parametrize(
    ("names", "planes"),
    [
        (("A_X", "B_X", "A_Y", "B_Y"), ("A", "B")),
        (("V13", "W13", "V24", "W24"), ("13", "24")),
        (("DE 45L", "DE 45R", "NDE 45L", "NDE 45R"), ("NDE 45", "DE 45")),
        (("Brg 1 Left", "Brg 1 Right", "Status", "Brg 2 Left", "Brg 2 Right"), ("Brg 1", "Brg 2")),
        (("Weg A oben", "Weg B oben", "Weg A unten", "Weg B unten"), ("Weg oben", "Weg unten")),
        (("Ch1 X", "Ch2 Y", "Ch3 X", "Ch4 Y"), ("plane 1", "plane 2")),
        (("1MAD10CY011", "1MAD10CY012", "1MAD20CY011", "1MAD20CY012"), ("1MAD10CY01", "1MAD20CY01")),
    ],
)
def test_pairs_by_tags(names, planes):
    arranged = arrangement_of(recording(*names), Profile())
    assert tuple(dict.fromkeys(sensor.bearing for sensor in arranged.sensors)) == planes
    assert len(set(arranged.channels)) == len(arranged.sensors) == 4
    record = record_of(recording(*names), arranged.sensors, profile=Profile(channels=dict(arranged.channels)))
    assert record.signals.shape == (10, 4)


@pytest.mark.parametrize("form", ["{} 45°", "{}_45deg", "45 deg {}", "Ch1 {} (45°)", "{}_45", "{}-45"])
@pytest.mark.parametrize("ends", [("NDE", "DE"), ("de", "nde"), ("TE", "CE")])
def test_planes_and_angles_in_the_names_of_channels_seat_them(ends, form, machine):
    """In any order of the file; planes of other names go in their order, and only when asked."""
    said = numbered(*(form.format(ends[k // 2]).replace("45", ("45", "135")[k % 2]) for k in range(4)))
    found = record_of(said, machine.sensors, profile=Profile(likely=ends[0] == "TE"))
    read = [3e-6, 2e-6, 1e-6, 0.0] if ends[0] == "de" else [1e-6, 0.0, 3e-6, 2e-6]
    np.testing.assert_allclose(found.signals[0], read)
    guess = guess_profile(said, Profile(likely=ends[0] == "TE"), machine.sensors)
    assert not any("channels of" in one for one in guess.missing)
    again = record_of(said, machine.sensors, profile=Profile(channels=guess.profile.channels))
    np.testing.assert_allclose(again.signals[0], read)
    assert arrangement_of(said, Profile()).angles_known


def test_an_angle_that_both_names_of_a_pair_end_with_is_no_angle_of_a_sensor():
    arranged = arrangement_of(recording("X_45", "Y_45", "X_90", "Y_90"), Profile())
    assert [sensor.bearing for sensor in arranged.sensors] == ["45", "45", "90", "90"]
    assert not arranged.angles_known


def test_names_of_sensors_in_a_profile_pair_the_channels_without_a_machine():
    rules = rules_of(None, ["DE_A=four", "NDE_A = one", "NDE_B = two", "DE_B = three"])
    arranged = arrangement_of(recording("one", "two", "three", "four"), rules)
    assert [sensor.bearing for sensor in arranged.sensors] == ["NDE", "NDE", "DE", "DE"]
    assert list(arranged.channels.values()) == ["one", "two", "four", "three"]


def test_a_tail_may_lack_the_speed_that_the_profile_names(tail, machine, tmp_path):
    save_record(replace(tail, speed=None, speed_time=None, speed_readings=None), tmp_path / "tail.h5")
    for speed in (SpeedSource(channel="Speed"), SpeedSource(pulses="KPH")):
        rules = Profile(speed=speed)
        with pytest.raises(RecordError, match=r"has no (speed channel 'Speed'|channel of pulses 'KPH')"):
            read_record(tmp_path / "tail.h5", machine, profile=rules)
        assert read_record(tmp_path / "tail.h5", machine, profile=rules, tail=True).speed is None


def test_a_channel_of_pulses_is_offered_by_its_name(machine):
    marked = recording(*API, extra=(channel("Ch5 KPH", "V", np.tile([-1.0, -9.0], 5)),))
    (asked,) = guess_profile(marked, Profile(likely=True), machine.sensors).missing
    assert '--pulses "Ch5 KPH"' in asked
    with pytest.raises(RecordError, match="'likely' finds pairs for 1 of 2 planes; say which"):
        record_of(recording("CH1", "CH2", "CH3"), machine.sensors, profile=Profile(likely=True))


def test_what_a_profile_writes_serves_look_with_and_without_the_machine(machine, tmp_path):
    names = recording(*API, extra=(channel("n", "rpm", np.full(10, 3600.0)),))
    alone = guess_profile(names, Profile())
    assert alone.missing == ()
    assert alone.profile.planes == {
        "VE-101": "Ch1 VE-101X, Ch2 VE-101Y",
        "VE-102": "Ch3 VE-102X, Ch4 VE-102Y",
    }
    given = rules_of(None, ["NDE: VE-101X, VE-101Y", "DE: VE-102X, VE-102Y"])
    known = guess_profile(names, given, machine.sensors)
    assert known.missing == ()
    save_profile(known.profile, tmp_path / "p.toml")
    rules = load_profile(tmp_path / "p.toml")
    assert record_of(names, machine.sensors, profile=rules).signals.shape == (10, 4)
    arranged = arrangement_of(names, rules)
    assert [sensor.bearing for sensor in arranged.sensors] == ["NDE", "NDE", "DE", "DE"]
