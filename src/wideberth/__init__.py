"""Detect and avoid for small drones, from raw sensor data to the waypoints an autopilot flies."""

__version__ = "0.1.0"
