"""A fixed wing of ours as an aircraft of JSBSim: the same coefficients, its equations of motion."""

from pathlib import Path
from typing import Any

import numpy as np

from wideberth.vehicles import fixed_wing_kernels as fk
from wideberth.vehicles.aircraft import Aircraft

METRE, POUND, SLUG_FT2 = 1 / 0.3048, 1 / 4.4482216152605, 1 / 1.3558179483314
LB_FT = POUND * METRE
DENSITY = 515.378818  # kg/m3 of a slug/ft3

ALPHA, BETA = "aero/alpha-rad", "aero/beta-rad"
SPAN, CHORD = "aero/bi2vel", "aero/ci2vel"
P, Q, R = (f"velocities/{axis}-aero-rad_sec" for axis in "pqr")
ELEVATOR, AILERON, RUDDER = "fcs/elevator-pos-rad", "fcs/left-aileron-pos-rad", "fcs/rudder-pos-rad"


def product(*factors: object) -> str:
    return "<product>" + "".join(f if str(f).startswith("<") else tag(f) for f in map(str, factors)) + "</product>"


def total(*terms: str) -> str:
    return "<sum>" + "".join(terms) + "</sum>"


def tag(factor: str) -> str:
    try:
        return f"<value>{float(factor)!r}</value>"
    except ValueError:
        return f"<property>{factor}</property>"


def axis(name: str, content: str) -> str:
    return f'<axis name="{name}"><function name="aero/ours/{name}">{content}</function></axis>'


def xml(c: Aircraft) -> str:
    """The aircraft's file; the stall is left out."""
    load = product("aero/qbar-psf", "metrics/Sw-sqft")
    linear = total(tag(str(c.lift[0])), product(c.lift[1], ALPHA))
    lift = total(linear, product(c.lift[2], CHORD, Q), product(c.lift[3], ELEVATOR))
    induced = c.area / (np.pi * c.oswald * c.span**2)
    drag = total(
        tag(str(c.drag[0])), product(induced, linear, linear), product(c.drag[2], ELEVATOR, ELEVATOR),
        product(c.drag[1], CHORD, f"<abs>{tag(Q)}</abs>"),
    )  # fmt: skip
    sine, cosine = f"<sin>{tag(ALPHA)}</sin>", f"<cos>{tag(ALPHA)}</cos>"

    def sideways(row: tuple[float, ...]) -> str:
        by = ((BETA,), (SPAN, P), (SPAN, R), (AILERON,), (RUDDER,))
        return total(*(product(value, *names) for value, names in zip(row, by, strict=True)))

    pitch = total(
        tag(str(c.pitch[0])), product(c.pitch[1], ALPHA), product(c.pitch[2], CHORD, Q), product(c.pitch[3], ELEVATOR)
    )
    span, chord = product(load, "metrics/bw-ft"), product(load, "metrics/cbarw-ft")
    jx, jy, jz, jxz = c.inertia
    place = '<location unit="M"><x>0</x><y>0</y><z>0</z></location>'
    return f"""<?xml version="1.0"?>
<fdm_config name="ours" version="2.0">
<metrics><wingarea unit="M2">{c.area}</wingarea><wingspan unit="M">{c.span}</wingspan>
<chord unit="M">{c.chord}</chord><location name="AERORP" unit="M"><x>0</x><y>0</y><z>0</z></location></metrics>
<mass_balance negated_crossproduct_inertia="false"><ixx unit="KG*M2">{jx}</ixx><iyy unit="KG*M2">{jy}</iyy>
<izz unit="KG*M2">{jz}</izz><ixz unit="KG*M2">{jxz}</ixz><emptywt unit="KG">{c.mass}</emptywt>
<location name="CG" unit="M"><x>0</x><y>0</y><z>0</z></location></mass_balance>
<ground_reactions/>
<external_reactions><property value="0">ours/torque-lbsft</property><force name="thrust" frame="BODY">{place}
<direction><x>1</x><y>0</y><z>0</z></direction></force></external_reactions>
<aerodynamics>
{axis("X", product(load, total(product(lift, sine), product(-1.0, drag, cosine))))}
{axis("Y", product(load, sideways(c.side)))}
{axis("Z", product(load, -1.0, total(product(lift, cosine), product(drag, sine))))}
{axis("ROLL", total(product(span, sideways(c.roll)), product(-1.0, "ours/torque-lbsft")))}
{axis("PITCH", product(chord, pitch))}
{axis("YAW", product(span, sideways(c.yaw)))}
</aerodynamics>
</fdm_config>
"""


class JsbsimTwin:
    """JSBSim with such an aircraft, asked for what it makes of a state."""

    def __init__(self, aircraft: Aircraft, folder: Path, altitude: float = 100.0) -> None:
        import jsbsim

        (folder / "aircraft" / "ours").mkdir(parents=True)
        (folder / "aircraft" / "ours" / "ours.xml").write_text(xml(aircraft))
        jsbsim.FGJSBBase().debug_lvl = 0
        self.fdm: Any = jsbsim.FGFDMExec(str(folder))
        self.fdm.set_aircraft_path("aircraft")
        assert self.fdm.load_model("ours")
        self.altitude = altitude
        self.fdm["ic/h-sl-ft"] = altitude * METRE
        self.fdm.run_ic()
        self.array = aircraft.array(self.fdm["atmosphere/rho-slugs_ft3"] * DENSITY)
        """Ours, in the air that it has."""

    def accelerations(self, x: np.ndarray, d: np.ndarray) -> np.ndarray:
        """Rates of change of body velocity and body rates, (6,); propulsion is ours."""
        fdm = self.fdm
        roll, pitch, yaw = fk.euler_angles(x)
        for name, value in (("phi", roll), ("theta", pitch), ("psi-true", yaw)):
            fdm[f"ic/{name}-rad"] = value
        for name, value in zip("uvw", x[3:6], strict=True):
            fdm[f"ic/{name}-fps"] = value * METRE
        for name, value in zip("pqr", x[10:], strict=True):
            fdm[f"ic/{name}-rad_sec"] = value
        fdm["ic/h-sl-ft"] = self.altitude * METRE
        thrust, torque = fk.thrust_and_torque(float(np.linalg.norm(x[3:6])), d[fk.THROTTLE], self.array)
        fdm["external_reactions/thrust/magnitude"] = thrust * POUND
        fdm["ours/torque-lbsft"] = torque * LB_FT
        for name, value in ((ELEVATOR, d[fk.ELEVATOR]), (AILERON, d[fk.AILERON]), (RUDDER, d[fk.RUDDER])):
            fdm[name] = value
        fdm.run_ic()
        linear = [fdm[f"accelerations/{name}dot-ft_sec2"] / METRE for name in "uvw"]
        return np.array(linear + [fdm[f"accelerations/{name}dot-rad_sec2"] for name in "pqr"])
