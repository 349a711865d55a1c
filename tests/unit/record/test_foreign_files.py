"""What other recorders write: damage and doubt are said with their true reason and the way out."""

import re

import h5py
import numpy as np
import pytest
import scipy.io
from tests.unit.record.exports import (
    COUNT,
    EXPORTS,
    MICRONS,
    START,
    STEP,
    TIME,
    VOLTS,
    comtrade,
    labview,
    universal,
)

from rotordrop import read_record
from rotordrop.errors import RecordError
from rotordrop.record.profile import Profile, TextLayout
from rotordrop.record.readers import read_recording
from rotordrop.record.record import open_record
from rotordrop.record.recording import known_unit, split_unit


def read(path, **rules):
    return read_recording(path, Profile(**rules))


def export(form):
    return next(one for one in EXPORTS if one.form == form)


def test_segments_that_do_not_follow_are_told_and_chosen(tmp_path):
    path = tmp_path / "drop.lvm"
    path.write_bytes(labview("No", segments=(range(25), range(25, COUNT)), gap=3.0))
    recording = read(path)
    (told,) = recording.warnings
    assert "holds 2 segments that do not follow each other; the first is read (first_data_line = " in told
    np.testing.assert_allclose(recording.channels[0].values, VOLTS[:25, 0], atol=1e-9)
    line = int(told.split("first_data_line = ")[1].split(" ")[0])
    second = read(path, text=TextLayout(first_data_line=line))
    assert second.warnings == ()
    np.testing.assert_allclose(second.channels[0].values, VOLTS[25:, 0], atol=1e-9)


@pytest.mark.parametrize("time", [np.nan, np.inf])
def test_samples_without_a_time_are_left_out(tmp_path, time):
    times = STEP * np.arange(400.0)
    times[[0, 200, 399]] = time
    path = tmp_path / "drop.csv"
    rows = np.column_stack([times, np.sin(np.arange(1600.0)).reshape(400, 4)])
    np.savetxt(path, rows, delimiter=",", header="time [s],A [um],B [um],C [um],D [um]", comments="")
    record = read_record(path)
    assert len(record.time) == 398 and record.missing.sum() == 4
    assert "left out, without a time: 3 of the samples" in record.warnings
    path.write_text(re.sub(r"(?m)^[-\d.]+e[^,]*", "nan", path.read_text()))
    with pytest.raises(
        RecordError, match="none of the 400 times of 'A' is a number; say the step in a profile"
    ):
        read_record(path)


def test_damage_to_segments_of_labview_is_told(tmp_path):
    path = tmp_path / "drop.lvm"
    lines = labview("One").decode().split("\r\n")
    path.write_text("\n".join(lines[:-12]) + "\n")
    (told,) = read(path).warnings
    assert f"declares {COUNT} samples and {COUNT - 10} are present" in told
    text = labview("No", segments=(range(25), range(25, COUNT))).decode()
    wrong = f"{VOLTS[30, 1]:.6f}"
    path.write_text(text.replace(wrong, "4.5x"))
    line = text.replace("\r\n", "\n").split(wrong)[0].count("\n") + 1
    with pytest.raises(RecordError, match=rf"line {line}, column 'NDE Y.*': '4\.5x' is not a number"):
        read(path)
    text = labview("No", segments=(range(25), range(25, COUNT))).decode()
    path.write_text(text.replace("***End_of_Header***", "**+End_of_Header***", 1), newline="")
    assert len(read(path).channels[0].values) == COUNT


@pytest.mark.parametrize("kind", ["ASCII", "BINARY32"])
def test_a_single_comtrade_file_that_was_cut_is_refused(kind, tmp_path):
    path = tmp_path / "drop.cff"
    comtrade(kind, single=True)(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) - 500])
    with pytest.raises(
        RecordError, match=r"truncated: its samples declare \d+ bytes|entries where|declares 60 samp"
    ):
        read(path)
    path.write_bytes(whole[: whole.index(b"--- file type: DAT")])
    with pytest.raises(RecordError, match=r"has no section DAT \(it has CFG, INF, HDR\)"):
        read(path)


@pytest.mark.parametrize("binary", ["", "<", ">"])
@pytest.mark.parametrize("padded", [True, False])
@pytest.mark.parametrize("last_end", [True, False])
def test_universal_files_are_those_that_another_reader_sees(binary, padded, last_end, tmp_path):
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "drop.uff"
    path.write_bytes(universal(binary=binary, padded=padded))
    sets = pyuff.UFF(str(path)).read_sets()
    path.write_bytes(universal(binary=binary, padded=padded, last_end=last_end))
    for channel, other in zip(read(path).channels, sets, strict=True):
        np.testing.assert_array_equal(channel.values, other["data"])
        np.testing.assert_allclose(channel.time, other["x"], atol=1e-9)
        assert (channel.label, channel.unit) == (
            other["id1"].strip(),
            other["ordinate_axis_units_lab"].strip(),
        )


def test_universal_text_without_blanks_between_numbers(tmp_path):
    path = tmp_path / "drop.uff"
    text = universal().decode()
    for value in np.unique(MICRONS):
        text = text.replace(f"{value:13.5e}", f"{value:13.6e}")  # a minus sign then follows a digit
    assert re.search(r"\d-\d\.", text)
    path.write_text(text)
    np.testing.assert_allclose(read(path).channels[1].values, MICRONS[:, 1], rtol=1e-6)


def test_uneven_times_and_spectra_of_universal_files(tmp_path):
    text = universal(names=["NDE X"], padded=False).decode()
    head, _, rest = text.partition(f"{2:10d}{COUNT:10d}{1:10d}")
    tail = rest.split("\n")
    body = "".join(f"{TIME[i]:13.5e}{MICRONS[i, 0]:13.5e}" + "\n" * (i % 3 == 2) for i in range(COUNT))
    path = tmp_path / "drop.uff"
    path.write_text(head + f"{2:10d}{COUNT:10d}{0:10d}" + "\n".join(tail[:5]) + "\n" + body + f"{-1:6d}")
    (channel,) = read(path).channels
    np.testing.assert_allclose(channel.time, TIME, atol=1e-8)
    np.testing.assert_allclose(channel.values, MICRONS[:, 0], rtol=1e-5)
    path.write_text(text.replace(f"{17:10d}{0:5d}", f"{18:10d}{0:5d}", 1))
    with pytest.raises(
        RecordError, match=r"holds no time history of dataset 58 \(it has spectrum 'NDE X'\); export"
    ):
        read(path)


def test_testlab_structures_must_be_whole_and_in_time(tmp_path):
    path = export("Testlab MAT, channels apart").written(tmp_path)
    held = scipy.io.loadmat(path, simplify_cells=True)
    content = {key: value for key, value in held.items() if key.startswith("Signal")}
    content["Signal_0"]["x_values"]["number_of_values"] = 99.0
    scipy.io.savemat(path, content)
    with pytest.raises(RecordError, match=r"Signal_0 declares 99 samples and 60 are present"):
        read(path)
    content["Signal_0"]["x_values"] |= {"number_of_values": 60.0, "increment": 0.0}
    scipy.io.savemat(path, content)
    with pytest.raises(
        RecordError, match=r"Signal_0 has the increment 0\.0; a time signal has a positive one"
    ):
        read(path)


def test_a_wav_file_asks_for_its_full_scale_whatever_unit_is_given(tmp_path):
    path = export("WAV").written(tmp_path)
    asked = r"holds shares of a full scale, from -1 to 1, .*--full-scale \"500 um\""
    for rules in (Profile(), Profile(unit="um"), Profile(units={"channel 1": "V"})):
        with pytest.raises(RecordError, match=asked):
            open_record(path, None, profile=rules)
    record, _ = open_record(path, None, profile=Profile(full_scale="500 um"))
    np.testing.assert_allclose(record.signals, MICRONS * 1e-6, atol=1e-8)


@pytest.mark.parametrize(("file", "option"), [("WAV", '--full-scale "500 um"'), ("no unit", "--unit um")])
def test_the_command_that_is_proposed_names_the_file_with_its_folder(file, option, machine, tmp_path):
    path = tmp_path / "drop.csv"
    if file == "WAV":
        path = export("WAV").written(tmp_path)
        machine = None
    else:
        columns = ",".join(sensor.name for sensor in machine.sensors)
        rows = [f"{TIME[i]:.6f},{','.join(f'{v:.2f}' for v in MICRONS[i])}" for i in range(COUNT)]
        path.write_text("\n".join([f"Time [s],{columns}", *rows]))
    with pytest.raises(RecordError, match=re.escape(f"'rotordrop profile {path} {option} -o recorder.toml'")):
        open_record(path, machine, profile=Profile())


def test_channels_of_their_own_rates_and_lengths_keep_them(tmp_path):
    text = export("SampleRate").content.decode().replace("20000.000,20000.000", "20000.000,10000.000", 1)
    path = tmp_path / "drop.csv"
    path.write_text(text)
    with pytest.raises(RecordError, match=r"no time column among .* and no sampling interval"):
        read(path)
    rows = [f"{START + i * STEP:.6f},{MICRONS[i, 0]}," for i in range(COUNT)]
    rows = [row + (f"{2 * i * STEP:.6f},{MICRONS[i, 1]}" if i < 30 else ",") for i, row in enumerate(rows)]
    path.write_text("\n".join(["Time [s],A [um],Time [s],B [um]", *rows]) + "\n")
    first, second = read(path).channels
    np.testing.assert_allclose(first.time, TIME, atol=1e-9)
    np.testing.assert_allclose(second.time, 2 * STEP * np.arange(30), atol=1e-9)
    np.testing.assert_allclose(second.values, MICRONS[:30, 1])


@pytest.mark.parametrize("wrong", ["(" * 20_000 + "m", "(m", "m)", "[[m]]", ")m("])
def test_brackets_that_do_not_match_are_no_unit(wrong):
    assert known_unit(wrong) is None
    assert known_unit("(m)") == known_unit("[m]") == known_unit(" m ") == "m"


def test_a_unit_of_a_megabyte_is_named_by_its_beginning(tmp_path):
    """A damaged attribute filled the terminal for a minute."""
    path = tmp_path / "drop.h5"
    with h5py.File(path, "w") as file:
        for name in ("A", "B"):
            file[name] = MICRONS[:, 0]
            file[name].attrs["unit"] = "m" * 60_000
        file["time"] = TIME
    (unit,) = {channel.unit for channel in read(path).channels if channel.unit}
    assert len(unit) == 201 and known_unit(unit) is None
    with pytest.raises(RecordError, match="can be displacements") as refusal:
        open_record(path, None, profile=Profile())
    assert len(str(refusal.value)) < 1500


@pytest.mark.parametrize(
    ("written", "name", "label", "unit"),
    [
        ("VE-101X um", "VE-101X", "VE-101X", "um"),
        ("X1, µm", "X1", "X1", "um"),
        ("Probe V", "Probe V", "Probe V", ""),
        ("n 1/min", "n", "n", "rpm"),
        ("S_A [um]", "S_A", "S_A", "um"),
        ("S_A (µm)", "S_A", "S_A", "um"),
        ("S_A_V", "S_A", "S_A_V", "V"),
        ("S_DE_A", "S_DE_A", "S_DE_A", ""),
        ("Speed_rpm", "Speed", "Speed_rpm", "rpm"),
        ("omega_rad_s", "omega", "omega_rad_s", "rad/s"),
        ("speed_rad_per_s", "speed", "speed_rad_per_s", "rad/s"),
        ("n_1_min", "n", "n_1_min", "rpm"),
        ("omega_rad/s", "omega", "omega_rad/s", "rad/s"),
        ("wm_radps", "wm", "wm_radps", "rad/s"),
        ("Drehzahl [U/min]", "Drehzahl", "Drehzahl", "rpm"),
        ("Kraft [kN]", "Kraft", "Kraft", "kN"),
    ],
)
def test_units_in_column_names(written, name, label, unit):
    assert split_unit(written) == (name, label, unit)


def test_one_damaged_field_does_not_turn_the_table_into_words(tmp_path):
    """Beside a status column of whole numbers all others passed as words, and only the status was read."""
    content = export("KKS tags").content
    row = next(line for line in content.split(b"\r\n")[30:])
    (tmp_path / "drop.csv").write_bytes(content.replace(row, row.replace(b";", b";%A", 2), 1))
    with pytest.raises(RecordError, match=r"line \d+, column '10MKA11CY01. \[mil\]': '%A.* is not a number"):
        read(tmp_path / "drop.csv")


def test_damage_to_a_universal_file_or_its_head_takes_no_channel_away(tmp_path):
    """A dataset whose type or whose line -1 was damaged was passed over without a word."""
    path = tmp_path / "drop.uff"
    whole = universal(binary="<", padded=False)
    second = whole.index(b"    58b", whole.index(b"    58b") + 1)
    for damaged, said in (
        (whole[:second] + whole[second:].replace(b"58b", b"50b", 1), r"where a line -1 and the type of a"),
        (whole[: second - 7] + whole[second - 7 :].replace(b"-1", b"-9", 1), r"stands b'-9.*where a line -1"),
    ):
        path.write_bytes(damaged)
        with pytest.raises(RecordError, match=said):
            read(path)
    path = tmp_path / "drop.csv"
    content = export("head beside the readings").content
    path.write_bytes(content.replace(b",Record Length", b",Rocord Length", 1))
    with pytest.raises(
        RecordError, match=r"line 1: 2\d fields with 3 times 'Record Length' are no heads of five"
    ):
        read(path)
    path.write_bytes(b"\r\n".join(content.split(b"\r\n")[:40]) + b"\r\n")
    (told,) = read(path).warnings
    assert "declares 60 samples and 40 are present" in told


def test_a_result_of_simulate_is_said_to_be_one(tmp_path):
    """It was refused for its 'coordinate', which has no clock."""
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "rotordrop drop 2"
        file["coordinate"] = np.zeros(4)
    with pytest.raises(RecordError, match=r"is a result of 'rotordrop simulate -o'.*no recording"):
        read(path)
