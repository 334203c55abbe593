"""Sensors: what comes in becomes a Scan."""

PARTS: dict[str, str] = {
    "adsb": "wideberth.sensors.adsb.simulated:SimulatedAdsb",
    "adsb_receiver": "wideberth.sensors.adsb.receiver:AdsbReceiver",
    "radar": "wideberth.sensors.radar.simulated:SimulatedRadar",
}
