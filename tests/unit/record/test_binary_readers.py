"""Binary recordings: the same samples in every format, and damage that must not pass silently."""

import re

import h5py
import numpy as np
import pytest
import scipy.io
from tests.unit.record.every_format import as_tdms, as_uff

from rotordrop.errors import RecordError, RotordropError
from rotordrop.examples import example_record_path
from rotordrop.record.profile import Profile
from rotordrop.record.readers import find_reader, known_formats, read_recording
from rotordrop.record.record import read_record, save_record


@pytest.fixture(scope="module")
def short(drop):
    return drop.window(-0.05, 0.05)


def as_matlab(record, path, *, packed=True, time=False):
    speed = {"t": record.speed_time, "hz": record.speed_readings / (2 * np.pi)}
    content = {
        "disp_um": (record.signals * 1e6).astype(np.float64),
        "channel": np.array(record.channel_names, dtype=object),
        "speed": speed,
        "info": "LP-400 drop",
    }
    content |= {"t": record.time} if time else {"fs": record.sampling_rate, "t0": record.time[0]}
    scipy.io.savemat(path, content, do_compression=packed)


def test_matlab_files_need_a_clock_and_equal_lengths(short, machine, tmp_path):
    path = tmp_path / "drop.mat"
    scipy.io.savemat(path, {"S_NDE_A": short.signals[:, 0]})
    with pytest.raises(RecordError, match=r"no samples with a clock among S_NDE_A"):
        read_record(path, machine)
    as_matlab(short, path, packed=False, time=True)
    path.write_bytes(path.read_bytes() + b"\x0e\x00\x00\x00\xff\x00\x00\x00")
    with pytest.raises(RecordError, match=r"declares 255 bytes and 0 are present"):
        read_recording(path, Profile())


def test_a_packed_matlab_variable_with_a_flipped_byte_is_refused(short, machine, tmp_path):
    path = tmp_path / "drop.mat"
    as_matlab(short, path)
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 0x55
    path.write_bytes(content)
    with pytest.raises(RecordError, match=r"cannot be unpacked|unpacks to"):
        read_record(path, machine)


def test_uff_with_another_count_than_declared_is_refused(short, machine, tmp_path):
    path = tmp_path / "drop.uff"
    as_uff(short, path)
    content = path.read_bytes()
    declared = f"{4:10d}{len(short.time):10d}".encode()
    path.write_bytes(content.replace(declared, f"{4:10d}{len(short.time) - 7:10d}".encode(), 1))
    with pytest.raises(RecordError, match=rf"'S_NDE_A' declares {len(short.time) - 7} samples"):
        read_record(path, machine)


@pytest.mark.parametrize(
    ("without", "change", "said"),
    [
        ((), lambda whole: whole + b"garbage" * 8, r"no TDMS segment at byte \d+ of \d+"),
        ((), lambda whole: whole[:12] + b"\xff" * 8 + whole[20:], r"segment at byte 0 declares no length"),
        (("wf_increment",), bytes, r"'Displacement/S_\w+' has no waveform property 'wf_increment'"),
    ],
)
def test_damaged_tdms_is_refused(without, change, said, short, machine, tmp_path):
    path = tmp_path / "drop.tdms"
    as_tdms(short, path, without=without)
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(RecordError, match=said):
        read_record(path, machine)


def _stored_outside(h5, folder):
    (folder / "raw.bin").write_bytes(bytes(800))
    h5.create_dataset("raw", (100,), "f8", external=[(str(folder / "raw.bin"), 0, 800)])


def _virtual(h5, folder):
    layout = h5py.VirtualLayout(shape=(100,), dtype="f8")
    layout[:] = h5py.VirtualSource(str(folder / "other.h5"), "x", shape=(100,))
    h5.create_virtual_dataset("virtual", layout)


def _shorter(h5, folder):
    values, attributes = h5["displacement/S_DE_A"][:-5], dict(h5["displacement/S_DE_A"].attrs)
    del h5["displacement/S_DE_A"]
    h5["displacement/S_DE_A"] = values
    h5["displacement/S_DE_A"].attrs.update(attributes)


def _half_written(h5, folder):
    h5.create_dataset("cut", (4096,), "f8", chunks=(1024,))[:2048] = 1.0


DANGEROUS = [
    (
        lambda h5, folder: h5.update({"displacement/other": h5py.ExternalLink(folder / "secret.h5", "/x")}),
        r"'displacement/other' is a ExternalLink \(to .*secret.h5:/x",
    ),
    (_stored_outside, r"the data of 'raw' lie in the file .*raw.bin"),
    (_virtual, r"'virtual' is a virtual dataset"),
    (
        lambda h5, folder: h5.create_dataset("bomb", (10**12,), "f8", chunks=(1024,)),
        r"'bomb' claims 1000000000000 samples in \d+ bytes; .*exhaust memory",
    ),
    (_half_written, r"of 'cut' only 2 of 4 blocks were written"),
    (
        lambda h5, folder: h5["displacement/S_DE_A"].attrs.pop("dt_s"),
        r"'displacement/S_DE_A' has neither an attribute 'fs_hz' or 'dt_s'",
    ),
    (_shorter, r"'displacement/S_NDE_A' has 2001 samples and 'displacement/S_DE_A' 1996"),
]


@pytest.mark.parametrize(("change", "said"), DANGEROUS, ids=lambda one: one if isinstance(one, str) else "")
def test_hdf5_that_points_outside_or_lacks_a_part_is_refused(change, said, short, machine, tmp_path):
    path = tmp_path / "drop.h5"
    save_record(short, path)
    with h5py.File(path, "r+") as h5:
        change(h5, tmp_path)
    with pytest.raises(RecordError, match=said):
        read_record(path, machine)


def test_a_flipped_byte_of_hdf5_is_noticed(short, machine, tmp_path):
    path = tmp_path / "drop.h5"
    save_record(short, path)
    with h5py.File(path, "r") as h5:
        offset = h5["displacement/S_DE_A"].id.get_chunk_info(0).byte_offset
    content = bytearray(path.read_bytes())
    content[offset + 40] ^= 0x10
    path.write_bytes(content)
    with pytest.raises(RotordropError, match=r"is damaged: it is not what rotordrop wrote"):
        read_record(path, machine)
    path.write_bytes(content[:-48])  # without the digest behind it, as another program writes one
    with pytest.raises(RecordError, match=r"'displacement/S_DE_A' cannot be unpacked"):
        read_record(path, machine)


def test_a_channel_that_begins_later_is_read_by_its_own_clock(short, machine, tmp_path):
    save_record(short, tmp_path / "drop.h5")
    with h5py.File(tmp_path / "drop.h5", "r+") as h5:
        h5["displacement/S_DE_B"].attrs["t0_s"] = -0.0495
    record = read_record(tmp_path / "drop.h5", machine)
    assert (record.time[0], len(record.time)) == (pytest.approx(-0.0495), 1991)
    np.testing.assert_array_equal(record.signals[:, :3], short.signals[10:, :3])
    np.testing.assert_array_equal(record.signals[:, 3], short.signals[:-10, 3])
    assert any("begin up to 500 µs apart" in note for note in record.notes)


def test_the_bundled_recording_reads(machine, whole_drop, tail):
    assert whole_drop.signals.shape == (45001, 4)
    assert whole_drop.sampling_rate == 20000.0
    assert whole_drop.time[0] == -0.25
    np.testing.assert_allclose(whole_drop.signals[0] * 1e6, [8.185, -6.976, -16.846, -16.315], atol=5e-4)
    assert tail.signals.shape == (3000, 4)
    assert tail.sampling_rate == 1000.0
    assert example_record_path("lp400_drop_060").name == "drop_060.h5"


def test_another_package_may_add_a_reader(monkeypatch, machine, short):
    class Entry:
        name = "vendor"

        @staticmethod
        def load():
            return lambda path, profile: "read by the vendor"

    monkeypatch.setattr(
        "rotordrop.record.readers.entry_points",
        lambda group: [Entry()] if group == "rotordrop.readers" else [],
    )
    assert find_reader("vendor", None)(None, None) == "read by the vendor"
    assert "vendor" in known_formats()


class TestFilesThatEndTheLibrary:
    """Damage that makes a library crash, loop or eat memory ends its child process, never this one."""

    def test_a_crash_of_scipy(self, short, tmp_path):
        path = tmp_path / "drop.mat"
        scipy.io.savemat(path, {"S_NDE_A": short.signals[:, 0], "t": short.time})
        content = bytearray(path.read_bytes())
        tag = content.index(b"\x09\x00\x00\x00", 128 + 48)  # the type of the samples, double
        content[tag : tag + 4] = b"\x00\x00\x09\x7f"
        path.write_bytes(content)
        with pytest.raises(RecordError, match=r"was ended by signal 11; the file is damaged|cannot be read"):
            read_recording(path, Profile())

    @pytest.mark.slow
    def test_an_endless_loop_of_the_hdf5_library(self, tmp_path):
        path = tmp_path / "drop.h5"
        with h5py.File(path, "w") as file:
            dataset = file.create_dataset("S", data=np.arange(50.0))
            for number in range(3):
                dataset.attrs[f"text {number}"] = 40 * "word "
        content = bytearray(path.read_bytes())
        heap = content.index(b"GCOL")
        content[heap + 16 : heap + 528] = bytes(512)
        path.write_bytes(content)
        try:
            read_recording(path, Profile())
        except RecordError as error:
            assert re.search(r"cannot be read within (4|20) s|no intact HDF5 file|clock", str(error))

    def test_a_file_that_unpacks_to_far_more(self, tmp_path):
        path = tmp_path / "drop.h5"
        with h5py.File(path, "w") as file:
            file.create_dataset("S", (5 * 10**8,), "i1", chunks=(10**6,), compression="gzip", fillvalue=0)
            for start in range(0, 5 * 10**7, 10**6):
                file["S"][start : start + 10**6] = 0
        with pytest.raises(RecordError, match=r"claims 500000000 samples in \d+ bytes; .*at most 67 MB"):
            read_recording(path, Profile())

    def test_a_link_that_leads_nowhere(self, short, machine, tmp_path):
        path = tmp_path / "drop.h5"
        save_record(short, path)
        content = path.read_bytes()[:-48]
        path.write_bytes(content.replace(b"S_DE_B\x00", b"S_DE_B\xff"))
        with pytest.raises(RecordError, match=r"no intact HDF5 file|leads nowhere|no channel 'S_DE_B'"):
            read_record(path, machine)

    def test_thousands_of_series(self, tmp_path):
        path = tmp_path / "drop.h5"
        with h5py.File(path, "w") as file:
            for number in range(2100):
                file[f"series {number}"] = np.arange(3)
        with pytest.raises(RecordError, match=r"more than 2000 datasets"):
            read_recording(path, Profile())
