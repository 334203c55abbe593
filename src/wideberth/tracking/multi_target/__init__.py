"""The default tracker: several hypotheses of motion, joint association with existence, births from pairs of plots."""
