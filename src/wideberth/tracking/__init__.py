"""Tracking: Scans become Tracks."""

PARTS: dict[str, str] = {"adsb_kalman": "wideberth.tracking.adsb_kalman:AdsbKalmanTracker"}

# Trackers of radar plots: each can run over a whole file, `run(plots: Plots) -> TrackTable`. The first is the default.
# They are no parts of a scenario while no radar is: fed with ADS-B alone they would see nobody, and all would be clear.
PLOT_TRACKERS: dict[str, str] = {
    "wideberth": "wideberth.tracking.multi_target.tracker:MultiTargetTracker",
    "rransac": "wideberth.tracking.rransac.tracker:RransacTracker",
    "er_rransac": "wideberth.tracking.rransac.tracker:ErRransacTracker",
    "rransac_article": "wideberth.tracking.rransac.tracker:RransacArticleTracker",
}
