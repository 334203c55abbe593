"""GDL90: what receivers for the cockpit send to displays (Garmin 560-1058-00, revision A)."""
