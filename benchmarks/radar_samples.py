"""CPU time of a frame of the 4 x 4 radar: 20 sweeps of 16 channels and 4096 samples, with five targets."""

from benchmarks.timing import cpu_seconds
from wideberth.sensors.radar.presets import PRESETS
from wideberth.sensors.radar.processing.frame import process_frame
from wideberth.sensors.radar.sweeps.simulate import RadarTarget, simulate_sweeps

TARGETS = [RadarTarget(100.0 + 80.0 * i, 0.3 * i - 0.5, 0.1 * i - 0.2, 5.0 * i - 10.0, 0.1) for i in range(5)]


def measure() -> dict[str, float]:
    """Return the CPU milliseconds of simulating a frame, and of processing it at two false alarm probabilities."""
    radar = PRESETS["uplooking_4x4"]
    quiet = radar.model_copy(update={"false_alarm_probability": 1e-3})
    samples = simulate_sweeps(radar, TARGETS, radar.averages, 1)
    return {
        "simulate_ms": 1e3 * cpu_seconds(lambda: simulate_sweeps(radar, TARGETS, radar.averages, 1)),
        "process_ms": 1e3 * cpu_seconds(lambda: process_frame(quiet, samples)),
        "process_at_preset_false_alarms_ms": 1e3 * cpu_seconds(lambda: process_frame(radar, samples)),
    }
