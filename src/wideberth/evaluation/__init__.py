"""Evaluation: scores, reports, and the search for missions that meet traffic."""
