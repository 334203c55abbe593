"""Monte Carlo evaluation: many random encounters, flown by the fast tier, in shards that can be resumed and spread."""
