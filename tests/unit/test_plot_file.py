"""Files of radar plots: what is read into what, what is refused in words, and what is passed on however bad."""

import dataclasses

import numpy as np
import pytest

from tests.made_tracks import made_arrays, made_truth, save
from wideberth.errors import InputError
from wideberth.sensors.radar.plot_file import PlotFile, Plots, read_plot_file

TRUTH = made_truth(40)
GROUND = made_arrays(TRUTH)
ONBOARD = made_arrays(made_truth(40, onboard=True), onboard=True)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "plots.npz"


def test_ground_radar(path):
    file = read_plot_file(save(path, GROUND))
    assert file.name == "plots.npz"
    assert file.seeds() == (0, 1)
    assert not file.onboard
    plots = file.scans(1)
    assert plots.n_scans == 40
    rows = GROUND["meas_seed"] == 1
    assert plots.first[0] == 0 and plots.first[-1] == len(plots.z) == rows.sum()
    for k in range(40):
        expected = GROUND["meas_range"][rows & (GROUND["meas_scan"] == k)]
        np.testing.assert_array_equal(plots.z[plots.first[k] : plots.first[k + 1], 0], expected)
    assert np.isnan(plots.z[:, 3]).all() and np.isnan(plots.sigma[3])
    np.testing.assert_array_equal(plots.sigma[:3], [0.4, 0.017, 0.017])
    np.testing.assert_array_equal(plots.sensor_attitude, np.tile(np.eye(3), (40, 1, 1)))
    assert plots.field_of_view == (np.pi, np.pi / 2)
    assert (plots.detection_probability, plots.range_max, plots.dt) == (0.9, 600.0, 0.1)


def test_the_ownships_telemetry_is_the_only_truth_that_a_tracker_sees(path):
    file = read_plot_file(save(path, GROUND))
    assert file.truth is not None
    plots = file.scans(0)
    np.testing.assert_allclose(plots.ownship[:, :3], TRUTH.position[:, 0])
    np.testing.assert_allclose(plots.ownship[:, 3:], TRUTH.velocity[:, 0])
    assert not {field.name for field in dataclasses.fields(Plots)} & {"truth", "visible"}
    plots.ownship[:] = plots.z[:] = 0.0
    np.testing.assert_allclose(file.truth.position, TRUTH.position)
    assert file.scans(0).z.any()


def test_onboard_radar(path):
    attitude = np.tile([0.1, -0.2, 0.7], (40, 1))
    file = read_plot_file(save(path, ONBOARD, own_att=attitude))
    plots = file.scans(0)
    assert file.onboard
    assert plots.field_of_view == pytest.approx((np.pi, np.pi / 3))
    assert np.isnan(plots.ownship).all()
    np.testing.assert_allclose(plots.sensor_position, ONBOARD["own_pos"] * [1, 1, -1])
    # Roll about the forward axis first, then pitch, then yaw.
    (cr, cp, cy), (sr, sp, sy) = np.cos(attitude[0]), np.sin(attitude[0])
    roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    np.testing.assert_allclose(plots.sensor_attitude[3], yaw @ pitch @ roll, atol=1e-15)


def test_field_of_view_is_as_given_or_as_the_file_says(path):
    save(path, GROUND, field_of_view=np.array([1.0, 0.5]))
    assert read_plot_file(path).field_of_view == (1.0, 0.5)
    assert read_plot_file(path, (2.0, 0.7)).field_of_view == (2.0, 0.7)
    with pytest.raises(InputError, match="field_of_view must be half-widths"):
        read_plot_file(path, (2.0, 2.0))


def test_a_file_without_truth(path):
    file = read_plot_file(save(path, GROUND, without=("truth_pos", "truth_vel", "truth_visible", "ownship_id")))
    assert file.truth is None
    assert np.isnan(file.scans(0).ownship).all()


def test_rows_of_a_seed_may_be_spread(path):
    order = np.argsort(GROUND["meas_scan"], kind="stable")  # all seeds scan by scan
    spread = {name: array[order] for name, array in GROUND.items() if name.startswith("meas_")}
    file, plain = read_plot_file(save(path, GROUND, **spread)), read_plot_file(save(path.with_name("b.npz"), GROUND))
    for seed in (0, 1):
        np.testing.assert_array_equal(file.scans(seed).z, plain.scans(seed).z)
        np.testing.assert_array_equal(file.scans(seed).first, plain.scans(seed).first)


def test_each_plot_may_have_its_own_variances(path):
    sigma = np.random.default_rng(1).uniform(0.1, 1.0, (len(GROUND["meas_seed"]), 4))
    sigma[:, 3] = np.nan  # there are no range rates
    assert read_plot_file(save(path, GROUND)).variance is None
    file = read_plot_file(save(path, GROUND, meas_sigma=sigma))
    plots = file.scans(1)
    np.testing.assert_array_equal(plots.variance, sigma[GROUND["meas_seed"] == 1] ** 2)
    order = np.argsort(GROUND["meas_scan"], kind="stable")
    spread = {name: array[order] for name, array in GROUND.items() if name.startswith("meas_")}
    again = read_plot_file(save(path, GROUND, **spread, meas_sigma=sigma[order]))
    np.testing.assert_array_equal(again.variance, file.variance)
    sigma[7, 1] = 0.0
    with pytest.raises(InputError, match="meas_sigma must be positive where something is measured, got 0 in row 7"):
        read_plot_file(save(path, GROUND, meas_sigma=sigma))
    with pytest.raises(InputError, match="meas_sigma must have shape"):
        read_plot_file(save(path, GROUND, meas_sigma=sigma[:, :3]))


def test_a_scan_without_plots_is_an_empty_scan(path):
    kept = GROUND["meas_scan"] != 7
    rows = {name: array[kept] for name, array in GROUND.items() if name.startswith("meas_")}
    plots = read_plot_file(save(path, GROUND, **rows)).scans(0)
    assert plots.first[7] == plots.first[8]
    assert plots.n_scans == 40


def test_an_unknown_seed_is_named(path):
    with pytest.raises(InputError, match=r"plots.npz has no seed 4: it has 0, 1"):
        read_plot_file(save(path, GROUND)).scans(4)


def changed(name, index, value):
    array = np.array(GROUND[name], dtype=np.float64, copy=True)
    array[index] = value
    return array


@pytest.mark.parametrize(
    ("name", "index", "value", "column"),
    [("meas_range", 5, np.nan, 0), ("meas_range", 5, -3.0, 0), ("meas_az", 5, np.inf, 1), ("meas_el", 5, 50.0, 2)],
)
def test_bad_plots_are_passed_on(path, name, index, value, column):
    z = read_plot_file(save(path, GROUND, **{name: changed(name, index, value)})).z
    np.testing.assert_array_equal(z[5, column], value)


def test_a_plot_that_is_not_of_its_scans_time_is_passed_on_as_nan(path):
    file = read_plot_file(save(path, GROUND, meas_time=changed("meas_time", [5, 6], [3.0, np.nan])))
    assert np.isnan(file.z[5:7]).all()
    assert np.isfinite(file.z[np.r_[:5, 7 : len(file.z)], :3]).all()


def test_time_that_goes_back_is_passed_on(path):
    t = changed("time", 20, 0.5)
    file = read_plot_file(save(path, GROUND, time=t, meas_time=t[GROUND["meas_scan"]]))
    np.testing.assert_array_equal(file.scans(0).t, t)
    assert np.isfinite(file.z[:, :3]).all()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"meas_range": GROUND["meas_range"][:-1]}, r"meas_range must have shape \(\d+,\), got \(\d+,\)"),
        ({"meas_scan": GROUND["meas_scan"].astype(float)}, "meas_scan must be whole numbers, got float64"),
        ({"meas_scan": GROUND["meas_scan"] + 1}, r"meas_scan is 40 in row \d+: time has 40 scans"),
        ({"meas_scan": GROUND["meas_scan"][::-1].copy()}, r"meas_scan goes back in row \d+"),
        ({"meas_az": np.array(["a"] * len(GROUND["meas_az"]))}, "meas_az must be numbers"),
        ({"time": np.array([])}, "time is empty"),
        ({"time": changed("time", 3, np.nan)}, r"time is not finite at \[3\]"),
        ({"sigma": np.array([0.4, 0.0, 0.1])}, "sigma must be positive"),
        ({"sigma": np.array([0.4, 0.1])}, r"sigma must have shape \(3,\), got \(2,\)"),
        ({"p_d": 0.0}, "p_d must be more than 0 and at most 1"),
        ({"p_d": np.array([0.9])}, r"p_d must have shape a single number, got \(1,\)"),
        ({"r_max": -1.0}, "r_max must be positive"),
        ({"dt": np.nan}, r"dt is not finite"),
        ({"truth_pos": np.zeros((39, 2, 3))}, r"truth_pos must have shape \(40, any, 3\), got \(39, 2, 3\)"),
        ({"truth_vel": np.zeros((40, 3, 3))}, r"truth_vel must have shape \(40, 2, 3\)"),
        ({"truth_visible": np.ones((40, 2))}, "truth_visible must be true or false"),
        ({"ownship_id": 2}, "ownship_id is 2: one of 2 targets"),
        ({"own_pos": np.zeros((40, 3))}, "lacks own_vel"),
        ({"field_of_view": np.array([4.0, 1.0])}, "field_of_view must be half-widths"),
    ],
)
def test_faults_of_make_are_refused(path, change, says):
    with pytest.raises(InputError, match=says) as error:
        read_plot_file(save(path, GROUND, **change))
    assert str(error.value).startswith("plots.npz")


def test_missing_arrays_are_all_named(path):
    with pytest.raises(InputError, match=r"plots\.npz lacks meas_az, time, p_d: it is no file of radar plots"):
        read_plot_file(save(path, GROUND, without=("meas_az", "time", "p_d")))


def test_what_is_no_file_of_plots(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        read_plot_file(tmp_path / "none.npz")
    with pytest.raises(InputError, match="cannot read"):
        read_plot_file(tmp_path)
    text = tmp_path / "text.npz"
    text.write_text("north,east\n1,2\n", encoding="utf-8")
    with pytest.raises(InputError, match="no plot file"):
        read_plot_file(text)
    np.save(tmp_path / "one.npy", np.zeros(3))
    with pytest.raises(InputError, match="one array"):
        read_plot_file(tmp_path / "one.npy")
    np.savez(tmp_path / "objects.npz", meas_seed=np.array([{}], dtype=object))
    with pytest.raises(InputError, match="no plot file"):
        read_plot_file(tmp_path / "objects.npz")


def test_a_file_is_frozen(path):
    file = read_plot_file(save(path, GROUND))
    assert isinstance(file, PlotFile)
    with pytest.raises(dataclasses.FrozenInstanceError):
        file.dt = 1.0
