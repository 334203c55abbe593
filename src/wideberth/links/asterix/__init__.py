"""ASTERIX (EUROCONTROL): plots of radars, system tracks and ADS-B reports as surveillance networks exchange them."""
