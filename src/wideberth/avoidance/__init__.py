"""Avoidance: what to fly when something is in the way."""

PARTS = {
    "local_level": "wideberth.avoidance.local_level:LocalLevelPlanner",
    "astar": "wideberth.avoidance.waypoint_paths.waypoint_manager:AStarPlanner",
    "astar_chain": "wideberth.avoidance.waypoint_paths.waypoint_manager:AStarChainPlanner",
}
