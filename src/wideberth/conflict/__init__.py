"""Conflict detection: what each track means for the ownship."""

PARTS = {
    "algorithm_2": "wideberth.conflict.detector:AdsbDetector",
    "path_cylinder": "wideberth.conflict.path_detector:PathCylinderDetector",
}
