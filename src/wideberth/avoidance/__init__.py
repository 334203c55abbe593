"""Avoidance: what to fly when something is in the way."""

PARTS = {"local_level": "wideberth.avoidance.local_level:LocalLevelPlanner"}
