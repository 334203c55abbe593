"""Cooperative collision avoidance of autonomous helicopters: vertical controllers, each on its own vehicle."""
