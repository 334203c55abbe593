"""Vehicle models, wind, and following of paths."""

PARTS = {"point_mass": "wideberth.vehicles.point_mass:PointMass"}
