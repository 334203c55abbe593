"""Made plots keep the rules that they are drawn by."""

import math

import numpy as np
import pytest

from wideberth.simulation.radar_plots import SIGMA, maneuvering_flights, radar_plots, straight_flights


def test_straight_flights_are_straight():
    position, velocity = straight_flights(np.random.default_rng(1), 4, 50)
    np.testing.assert_allclose(velocity, velocity[:1].repeat(50, axis=0), atol=1e-9)
    np.testing.assert_allclose(np.diff(position, axis=0), 0.1 * velocity[:-1], atol=1e-9)


def test_maneuvering_flights_turn_and_keep_within_reason():
    position, velocity = maneuvering_flights(np.random.default_rng(2), 6, 600)
    speed = np.linalg.norm(velocity, axis=2)
    assert speed.min() > 5.0 and speed.max() < 30.0
    turn = np.abs(np.diff(np.unwrap(np.arctan2(velocity[..., 1], velocity[..., 0]), axis=0), axis=0)) / 0.1
    assert math.radians(2.0) < turn.max() < math.radians(9.0)
    np.testing.assert_allclose(np.diff(position, axis=0), 0.05 * (velocity[:-1] + velocity[1:]), atol=5e-3)


def test_detections_noise_and_clutter_are_as_asked():
    rng = np.random.default_rng(3)
    position, velocity = np.tile([[[300.0, 0.0, -100.0]]], (2000, 1, 1)), np.zeros((2000, 1, 3))
    plots, truth = radar_plots(rng, position, velocity, clutter_max=4, ownship=0)
    assert truth.visible.all() and plots.first[-1] == len(plots.z)
    counts = np.diff(plots.first)
    # 0.8 of one target and a mean of two false plots; four standard errors.
    assert counts.mean() == pytest.approx(2.8, abs=4 * math.sqrt((2.0 + 0.16) / 2000))
    distance = np.linalg.norm(position[0, 0])
    near = np.abs(plots.z[:, :3] - [distance, 0.0, math.asin(100 / distance)]) < 6 * np.array(SIGMA)
    spread = (plots.z[near.all(axis=1), :3] - [distance, 0.0, math.asin(100 / distance)]).std(axis=0)
    np.testing.assert_allclose(spread, SIGMA, rtol=0.1)
    np.testing.assert_array_equal(plots.ownship[:, :3], position[:, 0])


def test_field_of_view_and_range_hide_aircraft():
    position = np.array([[[100.0, 0.0, 0.0], [-100.0, 0.0, 0.0], [700.0, 0.0, 0.0]]])
    args = np.random.default_rng(4), position, np.zeros_like(position)
    _, truth = radar_plots(*args, field_of_view=(1.0, 0.5))
    assert truth.visible.tolist() == [[True, False, False]]
