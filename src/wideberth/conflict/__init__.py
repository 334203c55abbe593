"""Conflict detection: what each track means for the ownship."""

PARTS = {"algorithm_2": "wideberth.conflict.detector:AdsbDetector"}
