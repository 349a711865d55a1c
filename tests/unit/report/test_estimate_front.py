"""What Python asks of an estimate: tables, data sets, files, figures and pages by name."""

import csv
import sys

import h5py
import numpy as np
import pytest
from scipy.io import loadmat

from rotordrop.errors import OutputError, UsageError
from rotordrop.estimate.bearing_drop import Origin
from rotordrop.estimate.estimate import Estimates
from rotordrop.physics.ball_bearing import bearing_constants


def test_the_data_set_has_units_and_selects_by_name(estimate):
    data = estimate.to_xarray()
    force = data["force"].sel(bearing="DE")
    drop = estimate.bearing("DE")
    np.testing.assert_array_equal(force, drop.force.values)
    assert data["force"].attrs == {"units": "N", "long_name": "ball force on the race"}
    assert data["time"].attrs["units"] == "s"
    steps = data["time"].values / float(data["time"][1] - data["time"][0])
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-4)
    assert float(data["stress_upper"].sel(bearing="NDE").max()) >= estimate.bearing("NDE").peak_stress.value
    assert float(force.sel(time=float(force.time[40]), method="nearest")) == drop.force.values[40]


def test_the_table_of_histories_and_that_of_drops_hold_the_same_peaks(estimate):
    frame = estimate.to_dataframe()
    assert frame.attrs["units"]["stress"] == "Pa"
    assert frame["NDE", "force"].max() == estimate.bearing("NDE").force.values.max()
    rows = Estimates([estimate, estimate]).to_dataframe()
    assert list(rows["bearing"]) == ["NDE", "DE", "NDE", "DE"]
    peak = estimate.bearing("DE").peak_force
    assert rows["peak force [N]"][1] == peak.value
    assert rows["peak force [N] 95 %"][1] == peak.interval_90[1]
    assert np.isnan(rows["mean force, 150 to 200 ms [N]"]).all(), "the record ends before"


@pytest.mark.parametrize("suffix", [".h5", ".nc", ".csv", ".mat", ".parquet"])
def test_histories_are_written_and_read_back(estimate, tmp_path, suffix):
    path = tmp_path / f"histories{suffix}"
    if suffix == ".parquet":
        parquet = pytest.importorskip("pyarrow.parquet")
    estimate.save(path)
    wanted = estimate.bearing("DE").force.values
    if suffix in (".h5", ".nc"):
        with h5py.File(path) as file:
            found = file["force"][:, list(file["bearing"].asstr()).index("DE")]
            assert file["force"].attrs["units"] == "N"
            assert file.attrs["simulated_record"] == "yes"
    elif suffix == ".mat":
        content = loadmat(path, simplify_cells=True)
        found = content["b_DE"]["force"]
        assert content["units"]["stress"] == "Pa" and content["simulated_record"] == "yes"
    elif suffix == ".parquet":
        table = parquet.read_table(path)
        found = table["DE force [N]"]
        assert table.schema.metadata[b"simulated_record"] == b"yes"
    else:
        with path.open(encoding="utf-8") as stream:
            rows = list(csv.reader(stream))
        assert rows[0][-1] == "simulated" and {row[-1] for row in rows[1:]} == {"yes"}
        found = [float(row[rows[0].index("DE force [N]")]) for row in rows[1:]]
    np.testing.assert_allclose(found, wanted, rtol=1e-8)


def test_a_format_nobody_knows_is_refused(estimate, tmp_path):
    with pytest.raises(OutputError, match=r"'\.xls' is not a format of histories; write one of \.h5"):
        estimate.save(tmp_path / "histories.xls")
    with pytest.raises(UsageError, match="bearing is 'X'; expected one of NDE, DE"):
        estimate.ball_loads("X")


def test_without_its_package_a_table_says_what_to_install(estimate, tmp_path, monkeypatch):
    tables = {"pandas": Estimates([estimate]).to_dataframe, "xarray": estimate.to_xarray}
    tables["pyarrow"] = lambda: estimate.save(tmp_path / "histories.parquet")
    for package, table in tables.items():
        monkeypatch.setitem(sys.modules, package, None)
        with pytest.raises(UsageError, match=rf"{package} is not installed; .*rotordrop\[tables\]"):
            table()


def test_page_and_numbers_are_written(estimate, tmp_path):
    estimate.report(tmp_path / "page.html")
    estimate.save(tmp_path / "numbers.json")
    assert {path.name for path in tmp_path.iterdir()} == {"page.html", "numbers.json"}


def test_ball_loads_agree_with_the_largest_and_with_the_force(estimate):
    drop = estimate.bearing("DE")
    assert drop.peak_force.origin is Origin.TWIN
    loads = estimate.ball_loads("DE")
    bearing = estimate.machine.bearing("DE").bearing
    assert loads.shape == (len(drop.force.time), 2, bearing.ball_count)
    coefficient = bearing_constants(bearing).stress_coefficient_inner
    stress = coefficient * loads.max(axis=(1, 2)) ** (1.0 / 3.0)
    at = int(np.argmax(drop.force.values))
    assert stress[at] == pytest.approx(drop.stress.values[at], rel=0.02)
