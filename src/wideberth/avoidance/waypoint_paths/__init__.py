"""Paths of waypoints round traffic: A* in space and time, the chain, and the waypoint control function."""
