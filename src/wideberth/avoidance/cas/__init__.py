"""Cooperative collision avoidance of autonomous helicopters: controllers, each on its own vehicle."""
