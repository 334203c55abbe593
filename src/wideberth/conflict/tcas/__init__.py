"""TCAS as the other aircraft may carry it: when it alerts, what it advises, and what goes with that."""

from wideberth.conflict.tcas.advisories import Advisory, Sense, VerticalAdvisory, complementary_sense
from wideberth.conflict.tcas.alerts import TcasAlert, tcas_alert
from wideberth.conflict.tcas.horizontal import Passing, TcasThreeUnit, Turn, TurnAdvisory
from wideberth.conflict.tcas.logic import TcasUnit
from wideberth.conflict.tcas.thresholds import TCAS_I, TCAS_II, TcasThresholds, sensitivity_level

__all__ = [
    "TCAS_I",
    "TCAS_II",
    "Advisory",
    "Passing",
    "Sense",
    "TcasAlert",
    "TcasThreeUnit",
    "TcasThresholds",
    "TcasUnit",
    "Turn",
    "TurnAdvisory",
    "VerticalAdvisory",
    "complementary_sense",
    "sensitivity_level",
    "tcas_alert",
]
