"""Tracking: Scans become Tracks."""

PARTS: dict[str, str] = {"adsb_kalman": "wideberth.tracking.adsb_kalman:AdsbKalmanTracker"}

# Trackers of radar plots: each can run over a whole file, `run(plots: Plots) -> TrackTable`. The first is the default.
PLOT_TRACKERS: dict[str, str] = {
    "wideberth": "wideberth.tracking.multi_target:MultiTargetTracker",
    "rransac": "wideberth.tracking.rransac.tracker:RransacTracker",
    "er_rransac": "wideberth.tracking.rransac.tracker:ErRransacTracker",
    "rransac_article": "wideberth.tracking.rransac.tracker:RransacArticleTracker",
}
