"""Radars of the thesis, by name."""

from wideberth.sensors.radar.config import RadarConfig
from wideberth.sensors.radar.sweeps.config import ReceiverConfig

_RECEIVER = ReceiverConfig(channel_coupling_db=-20.0, adc_bits=12)

PRESETS: dict[str, RadarConfig] = {
    "table_5_1": RadarConfig(receiver=_RECEIVER),
    "uplooking_4x4": RadarConfig(
        sweep_time_ms=2.0,
        if_bandwidth_mhz=1.024,
        transmit_power_w=5000.0,
        channels=16,
        array_rows=4,
        averages=20,
        false_alarm_probability=0.1,
        azimuth_fov_deg=360.0,
        elevation_fov_deg=180.0,
        azimuth_beamwidth_deg=None,
        elevation_beamwidth_deg=None,
        boresight_elevation_deg=90.0,
        receiver=_RECEIVER,
    ),
    "onboard_unit": RadarConfig(boresight_azimuths_deg=(0.0, 120.0, 240.0), receiver=_RECEIVER),
}
"""The line array of four elements (table 5.1), the simulated radar on the ground that looks up (4.1 and 4.5), and three
units of the first kind around an aircraft (3.3). Coupling is that of table 5.1; the 12 bits of the A/D converter are
assumed."""
