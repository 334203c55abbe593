"""Volumes that no maneuver may enter: geofences, cylinders, terrain."""
