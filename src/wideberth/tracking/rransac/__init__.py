"""Recursive RANSAC: the trackers of the thesis, linear (R-RANSAC) and extended to turning aircraft (ER-RANSAC)."""
