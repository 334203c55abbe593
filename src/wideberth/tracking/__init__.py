"""Tracking: Scans become Tracks."""

# Trackers of radar plots: each can run over a whole file, `run(plots: Plots) -> TrackTable`. The first is the default.
PLOT_TRACKERS: dict[str, str] = {
    "wideberth": "wideberth.tracking.multi_target.tracker:MultiTargetTracker",
    "rransac": "wideberth.tracking.rransac.tracker:RransacTracker",
    "er_rransac": "wideberth.tracking.rransac.tracker:ErRransacTracker",
    "rransac_article": "wideberth.tracking.rransac.tracker:RransacArticleTracker",
}

# Each says in `hears` which kinds of scan it takes; a scenario with a sensor that its tracker cannot hear is refused.
PARTS: dict[str, str] = {"adsb_kalman": "wideberth.tracking.adsb_kalman:AdsbKalmanTracker", **PLOT_TRACKERS}
