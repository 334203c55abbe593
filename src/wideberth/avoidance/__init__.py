"""Avoidance: what to fly when something is in the way."""

PARTS = {
    "local_level": "wideberth.avoidance.local_level:LocalLevelPlanner",
    "astar": "wideberth.avoidance.waypoint_paths.waypoint_manager:AStarPlanner",
    "astar_chain": "wideberth.avoidance.waypoint_paths.waypoint_manager:AStarChainPlanner",
    "cas_bang_bang": "wideberth.avoidance.vertical.planner:BangBangPlanner",
    "cas_continuous": "wideberth.avoidance.vertical.planner:ContinuousPlanner",
}
