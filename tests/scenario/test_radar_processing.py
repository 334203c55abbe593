"""Frames with targets, noise and clutter through the whole chain of a radar."""

import numpy as np
import pytest

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.processing.averaging import detection_power
from wideberth.sensors.radar.processing.config import ProcessingConfig
from wideberth.sensors.radar.processing.detection_level import detection_model, detection_threshold, searched_bins
from wideberth.sensors.radar.processing.frame import process, process_frame
from wideberth.sensors.radar.processing.frame_powers import frame_image, frame_powers
from wideberth.sensors.radar.processing.noise_statistics import noise_statistics, theoretical_noise
from wideberth.sensors.radar.processing.radar_processor import RadarProcessor
from wideberth.sensors.radar.sweeps.paths import RadarTarget
from wideberth.sensors.radar.sweeps.simulate import simulate_noise, simulate_sweeps

RADAR = RadarConfig()
SMALL = RadarConfig(sweep_time_ms=0.512, if_bandwidth_mhz=0.5, averages=16, false_alarm_probability=1e-3)
ALL = np.ones(4, np.bool_)


def with_processing(radar: RadarConfig, **settings) -> RadarConfig:
    return radar.model_copy(update={"processing": ProcessingConfig(**settings)})


@pytest.mark.parametrize("swerling", [0, 1, 3])
@pytest.mark.parametrize(("rcs", "distance"), [(0.01, 250.0), (1.0, 600.0)])
def test_targets_are_seen_as_often_as_the_scan_says(rcs: float, distance: float, swerling: int) -> None:
    radar = with_processing(RADAR, reference_rcs_m2=rcs).model_copy(update={"swerling": swerling})
    model = detection_model(radar)
    promised = np.interp(distance, model.ranges, model.probabilities)
    assert promised > (0.9 if swerling != 1 else 0.85)
    rng, seen, n = np.random.default_rng([1, swerling]), 0, 20
    for k in range(n):
        target = RadarTarget(distance + rng.uniform(-0.15, 0.15), range_rate=8.0, rcs=rcs, swerling=swerling)
        z = process(radar, simulate_sweeps(radar, [target], 32, [2, k])).z
        seen += bool(len(z) and np.abs(z[:, 0] - target.range).min() < 1.0)
    assert abs(seen / n - promised) < 4.0 * np.sqrt(promised * (1.0 - promised) / n) + 1e-9 + 1.0 / n


@pytest.mark.parametrize("window", ["hann", "rectangular"])
@pytest.mark.parametrize("kind", ["gamma", "ca_cfar", "os_cfar"])
def test_noise_frames_have_the_false_alarms_that_are_set(kind: str, window: str) -> None:
    radar = with_processing(SMALL, threshold=kind, window=window).model_copy(update={"false_alarm_probability": 0.01})
    noise, over, cells = theoretical_noise(radar), 0, 0
    for k in range(200):
        powers, looks = frame_powers(radar, frame_image(radar, simulate_noise(radar, 16, [3, k])))
        found = detection_power(radar, np.empty((16, 4, 256), np.complex64), powers, ALL)
        over += int(np.count_nonzero(found.power > detection_threshold(radar, found, powers, looks, noise, ALL)))
        cells += searched_bins(radar).stop - searched_bins(radar).start
    # Neighbours are correlated with the window: twice the variance at most.
    assert over / cells == pytest.approx(0.01, abs=4.0 * np.sqrt(2.0 * 0.01 / cells))


def test_a_target_on_a_bin_centre_needs_the_window_for_two_bins() -> None:
    target = [RadarTarget(200 * SMALL.range_bin * 0.5, rcs=1.0)]
    samples = simulate_sweeps(SMALL, target, 16, 4)
    assert len(process(SMALL, samples).z) == 1
    rectangular = process_frame(with_processing(SMALL, window="rectangular"), samples)
    assert rectangular.detected[100] and not rectangular.detected[[99, 101]].any() and not len(rectangular.kept)


def test_a_scan_says_what_it_is() -> None:
    target = [RadarTarget(40.0, azimuth=0.3, elevation=0.1, range_rate=3.0, rcs=0.1)]
    line = process(SMALL, simulate_sweeps(SMALL, target, 16, 5), t=2.0, sensor="left", position=np.ones(3))
    assert (line.kind, line.sensor, line.t) == ("radar_cone", "left", 2.0) and line.detection is not None
    cone = np.arcsin(np.sin(0.3) * np.cos(0.1))
    assert np.abs(line.z[0, 1] - cone) < 5.0 * np.sqrt(line.R[0, 1, 1])
    assert np.isnan(line.z[0, 2]) and np.isnan(line.R[0, 2, 2])
    plane_radar = SMALL.model_copy(update={"channels": 16, "array_rows": 4})
    plane = process(plane_radar, simulate_sweeps(plane_radar, target, 16, 5))
    assert plane.kind == "radar"
    error = np.abs(plane.z[0] - [40.0, 0.3, 0.1, 3.0])
    assert np.all(error < 5.0 * np.sqrt(np.diagonal(plane.R[0])))
    assert np.count_nonzero(plane.R[0] - np.diag(np.diagonal(plane.R[0]))) == 0


def test_plots_are_bounded_and_counted() -> None:
    targets = [RadarTarget(10.0 + 5.0 * k, rcs=0.1) for k in range(10)]
    scan = process(with_processing(SMALL, max_plots=4), simulate_sweeps(SMALL, targets, 16, 6))
    assert len(scan.z) <= 4 and scan.health is not None and scan.health.rejects["beyond_max_plots"] >= 6
    assert np.all(np.diff(scan.z[:, 0]) > 0.0)


def made_frames(n: int) -> list[np.ndarray]:
    """A static scene of ten echoes, and one target that moves."""
    scene = [RadarTarget(8.0 + 6.1 * k, rcs=0.3) for k in range(10)]
    return [
        simulate_sweeps(SMALL, [*scene, RadarTarget(30.2 + 1.3 * k, range_rate=13.0, rcs=0.3)], 16, [7, k])
        for k in range(n)
    ]


@pytest.mark.parametrize("clutter_filter", ["moving_target", "map"])
def test_a_static_scene_does_not_flood_the_tracker(clutter_filter: str) -> None:
    frames = made_frames(12)
    plain = [RadarProcessor(SMALL).step(0.1, f) for f in frames]
    assert min(len(s.z) for s in plain if s is not None) >= 9
    processor = RadarProcessor(with_processing(SMALL, clutter_filter=clutter_filter))
    scans = [processor.step(0.1 * k, f) for k, f in enumerate(frames)]
    kept = [(k, s) for k, s in enumerate(scans) if s is not None]
    assert len(kept) == (11 if clutter_filter == "map" else 12)
    assert np.mean([len(s.z) for _, s in kept]) < 2.5
    seen = [len(s.z) and np.abs(s.z[:, 0] - (30.2 + 1.3 * k)).min() < 0.5 for k, s in kept]
    assert np.mean(seen) >= 0.7  # the map hides it where it passes a static echo


def test_the_noise_level_is_followed_over_a_stream() -> None:
    start = noise_statistics(SMALL, (simulate_noise(SMALL, 16, [8, k]) for k in range(50)))
    processor, counts = RadarProcessor(SMALL, start), []
    for k in range(150):
        gain = np.float32(10.0 ** (0.02 * min(k / 75.0, 1.0)))  # 0.4 dB in an hour and a quarter
        assert processor.step(60.0 * (k + 1), gain * simulate_noise(SMALL, 16, [9, k])) is not None
        assert processor.last is not None
        counts.append(int(processor.last.detected.sum()))
    assert processor.noise is not None
    assert 10.0 * np.log10(processor.noise.power.mean() / start.power.mean()) == pytest.approx(0.4, abs=0.06)
    # A thousandth of 254 bins is 0.25 a frame, correlated in pairs; not followed it were over 3.
    assert np.mean(counts[75:]) < 0.6


def test_frames_that_say_nothing_are_counted_and_give_no_scan() -> None:
    processor = RadarProcessor(SMALL)
    good = simulate_noise(SMALL, 16, 10)
    assert processor.step(1.0, good) is not None
    assert processor.step(1.0, good) is None and processor.step(0.5, good) is None
    assert processor.step(2.0, np.full_like(good, np.nan)) is None
    assert processor.rejects["frame_out_of_order"] == 2 and processor.rejects["frame_unusable"] == 1
    assert processor.step(2.0, good) is not None
    with pytest.raises(ValueError, match="t must be finite"):
        processor.step(np.nan, good)
    with pytest.raises(ValueError, match="shape"):
        processor.step(3.0, good[:, :2])
    with pytest.raises(ValueError, match="another radar"):
        RadarProcessor(RADAR, theoretical_noise(SMALL))
