"""The vertical controllers of `avoidance.cas` as planners among aircraft that are only seen."""
