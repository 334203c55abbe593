"""Tracking: Scans become Tracks."""

PARTS: dict[str, str] = {
    "adsb_kalman": "wideberth.tracking.adsb_kalman:AdsbKalmanTracker",
    "wideberth": "wideberth.tracking.multi_target.tracker:MultiTargetTracker",
    "rransac": "wideberth.tracking.rransac.tracker:RransacTracker",
    "er_rransac": "wideberth.tracking.rransac.tracker:ErRransacTracker",
    "rransac_article": "wideberth.tracking.rransac.tracker:RransacArticleTracker",
}

# Those of radar plots can run over a whole file as well, `run(plots: Plots) -> TrackTable`. The first is the default.
PLOT_TRACKERS: dict[str, str] = {name: address for name, address in PARTS.items() if name != "adsb_kalman"}
