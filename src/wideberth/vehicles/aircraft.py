"""The fixed wings that are known by name: mass, geometry, aerodynamic coefficients, propulsion, limits."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wideberth.types import FloatArray
from wideberth.vehicles import fixed_wing_kernels as fk

AIR_DENSITY = 1.2682  # kg/m3, of Beard and McLain


@dataclass(frozen=True, slots=True)
class MotorPropeller:
    """An electric motor with a propeller. m, V, V s/rad, ohm, A; torque and thrust against the advance ratio J."""

    diameter: float
    volts: float
    kv: float
    resistance: float
    no_load_current: float
    torque: tuple[float, float, float]
    thrust: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class BlownDisc:
    """A disc (m2) that blows air back at `k_motor` (m/s) times the throttle."""

    area: float
    k_motor: float


@dataclass(frozen=True, slots=True)
class Aircraft:
    """A fixed wing.

    Attributes
    ----------
    mass : float
        kg.
    inertia : tuple of float
        Jx, Jy, Jz, Jxz, kg m2.
    area, span, chord : float
        m2, m, m.
    oswald, stall_sharpness, stall_angle : float
        e, M and alpha0 (rad).
    lift, pitch : tuple of float
        Coefficient at zero, by angle of attack, pitch rate and elevator.
    drag : tuple of float
        Parasitic, by pitch rate, by the square of the elevator.
    side, roll, yaw : tuple of float
        Coefficients by sideslip, roll rate, yaw rate, aileron, rudder.
    propulsion : MotorPropeller or BlownDisc
    design_speed : float
        Airspeed at which the autopilot's gains are computed, m/s.
    deflection_max : float
        Of every surface, rad.
    """

    mass: float
    inertia: tuple[float, float, float, float]
    area: float
    span: float
    chord: float
    oswald: float
    stall_sharpness: float
    stall_angle: float
    lift: tuple[float, float, float, float]
    drag: tuple[float, float, float]
    pitch: tuple[float, float, float, float]
    side: tuple[float, float, float, float, float]
    roll: tuple[float, float, float, float, float]
    yaw: tuple[float, float, float, float, float]
    propulsion: MotorPropeller | BlownDisc
    design_speed: float
    deflection_max: float

    @property
    def has_rudder(self) -> bool:
        """Whether a rudder does anything."""
        return self.yaw[4] != 0.0

    def array(self, air_density: float = AIR_DENSITY) -> FloatArray:
        """Return the kernels' array of this aircraft (indices ``A_...``) in air of a density, kg/m3."""
        a = np.zeros(fk.N_AIRCRAFT)
        jx, jy, jz, jxz = self.inertia
        g = jx * jz - jxz * jxz
        a[fk.A_MASS], a[fk.A_JY] = self.mass, jy
        a[fk.A_AREA], a[fk.A_SPAN], a[fk.A_CHORD] = self.area, self.span, self.chord
        a[fk.A_DENSITY] = air_density
        a[fk.A_GAMMA : fk.A_GAMMA + 8] = (
            jxz * (jx - jy + jz) / g,
            (jz * (jz - jy) + jxz * jxz) / g,
            jz / g,
            jxz / g,
            (jz - jx) / jy,
            jxz / jy,
            ((jx - jy) * jx + jxz * jxz) / g,
            jx / g,
        )
        a[fk.A_STALL_M], a[fk.A_STALL_ALPHA] = self.stall_sharpness, self.stall_angle
        a[fk.A_CL0 : fk.A_CL0 + 4] = self.lift
        a[fk.A_CD_P], a[fk.A_CD_Q], a[fk.A_CD_DE] = self.drag
        a[fk.A_CD_INDUCED] = self.area / (math.pi * self.oswald * self.span**2)
        a[fk.A_CM0 : fk.A_CM0 + 4] = self.pitch
        for first, row in ((fk.A_CY_BETA, self.side), (fk.A_CROLL_BETA, self.roll), (fk.A_CN_BETA, self.yaw)):
            a[first : first + 5] = row
        power = self.propulsion
        if isinstance(power, BlownDisc):
            a[fk.A_MOTOR], a[fk.A_PROP_AREA], a[fk.A_K_MOTOR] = 1.0, power.area, power.k_motor
        else:
            a[fk.A_PROP_DIAMETER], a[fk.A_VOLTS], a[fk.A_KV] = power.diameter, power.volts, power.kv
            a[fk.A_RESISTANCE], a[fk.A_NO_LOAD] = power.resistance, power.no_load_current
            a[fk.A_CQ : fk.A_CQ + 3], a[fk.A_CT : fk.A_CT + 3] = power.torque, power.thrust
        return a


AEROSONDE = Aircraft(
    mass=11.0,
    inertia=(0.8244, 1.135, 1.759, 0.1204),
    area=0.55,
    span=2.8956,
    chord=0.18994,
    oswald=0.9,
    stall_sharpness=50.0,
    stall_angle=0.47,
    lift=(0.23, 5.61, 7.95, 0.13),
    drag=(0.043, 0.0, 0.0135),
    pitch=(0.0135, -2.74, -38.21, -0.99),
    side=(-0.98, 0.0, 0.0, 0.075, 0.19),
    roll=(-0.13, -0.51, 0.25, 0.17, 0.0024),
    yaw=(0.073, 0.069, -0.095, -0.011, -0.069),
    propulsion=MotorPropeller(
        diameter=20 * 0.0254,
        volts=12 * 3.7,
        kv=60.0 / (2.0 * math.pi * 145.0),
        resistance=0.042,
        no_load_current=1.5,
        torque=(0.005230, 0.004970, -0.01664),
        thrust=(0.09357, -0.06044, -0.1079),
    ),
    design_speed=27.0,
    deflection_max=math.radians(45.0),
)
# As printed, C_n_beta is 0.0004: then C_n_beta - C_l_beta C_n_da / C_l_da is negative, and sideslip runs away in any
# turn that ailerons hold; there is no rudder. The fins of such a wing give some hundredths; 0.02 is ours.
ZAGI = Aircraft(
    mass=1.56,
    inertia=(0.1147, 0.0576, 0.1712, 0.0015),
    area=0.2589,
    span=1.4224,
    chord=0.3302,
    oswald=0.9,
    stall_sharpness=50.0,
    stall_angle=0.4712,
    lift=(0.09167, 3.5016, 2.8932, 0.2724),
    drag=(0.0254, 0.0, 0.3045),
    pitch=(-0.02338, -0.5675, -1.399, -0.3254),
    side=(-0.07359, 0.0, 0.0, 0.0, 0.0),
    roll=(-0.02854, -0.3209, 0.03066, 0.1682, 0.0),
    yaw=(0.02, -0.01297, -0.00434, -0.00328, 0.0),
    propulsion=BlownDisc(area=0.0314, k_motor=20.0),
    design_speed=13.0,
    deflection_max=math.radians(45.0),
)
AIRCRAFT: Mapping[str, Aircraft] = {"aerosonde": AEROSONDE, "zagi": ZAGI}
