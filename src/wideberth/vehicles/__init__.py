"""Vehicle models, wind, and following of paths."""

PARTS = {
    "point_mass": "wideberth.vehicles.point_mass:PointMass",
    "fixed_wing": "wideberth.vehicles.fixed_wing:FixedWing",
    "multirotor": "wideberth.vehicles.multirotor:Multirotor",
}
