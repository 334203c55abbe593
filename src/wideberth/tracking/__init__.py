"""Tracking: Scans become Tracks."""

PARTS: dict[str, str] = {"adsb_kalman": "wideberth.tracking.adsb_kalman:AdsbKalmanTracker"}
