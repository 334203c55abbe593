"""An autopilot over MAVLink 2: telemetry and traffic in, maneuvers and traffic out (docs/mavlink.md)."""
