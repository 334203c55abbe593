"""One vehicle's controller from messages to commands."""

from typing import Any

import numpy as np
import pytest

from tests.naive import cas as naive
from wideberth.avoidance.cas.config import CasConfig, cas_preset
from wideberth.avoidance.cas.vehicle_controller import VehicleController
from wideberth.avoidance.cas.vehicle_message import VehicleMessage

OWN = np.array([-20.0, 0, -15.2, 1.5, 0, 0])
OTHER = np.array([20.0, 0, -15, -1.5, 0, 0])
CROSSING = np.array([0.0, -30.0, -15.1, 0, 1.5, 0])


def message(x: Any, sender: int = 1, **changes: Any) -> VehicleMessage:
    return VehicleMessage(sender, 0.0, x[:3], x[3:], **changes)


@pytest.mark.parametrize("controller", ["interval", "bang_bang", "continuous"])
def test_nobody_known_is_guidance(controller: Any) -> None:
    control = VehicleController(CasConfig(controller=controller), 0)
    decision = control.decide(0.0, OWN, -15.0)
    assert (decision.avoid, decision.reason, control.target) == (False, "none", None)
    assert decision.rate == pytest.approx(0.1) and np.isnan(decision.t_star)


@pytest.mark.parametrize("number", [0, 2])
@pytest.mark.parametrize("controller", ["bang_bang", "continuous"])
def test_a_pair_is_decided_as_by_the_naive_twin(controller: Any, number: int) -> None:
    config = cas_preset("thesis", controller=controller, law="shared_corrected")
    law: Any = naive.continuous if controller == "continuous" else naive.bang_bang
    for x in (4.0, 8.0, 12.0, 20.0):
        for height in (-15.0, -15.3):
            own, other = OWN.copy(), OTHER.copy()
            own[0], other[0], own[2], other[2] = -x, x, height, -15.0
            for cooperates in (True, False):
                control = VehicleController(config, number)
                control.take(message(other, cooperates=cooperates), 0.0)
                got = control.decide(0.0, own, -15.0)
                believed = config.model_copy(update={"other_cooperates": cooperates})
                before = (False,) if controller == "continuous" else (False, 0.0)
                assert (got.reason, got.rate) == pytest.approx(law(own, other, -15.0, *before, number == 0, believed))
                assert control.target == (1 if got.avoid else None)
                assert (got.t_star, got.d_star) == pytest.approx(
                    naive.closest(own[:3] - other[:3], own[3:] - other[3:])
                )


def test_interval_passes_everybody_and_names_who_binds() -> None:
    control = VehicleController(CasConfig(smoothing=1.0), 0)
    control.take(message(OTHER), 0.0)
    control.take(message(CROSSING, 2), 0.0)
    decision = control.decide(0.0, OWN, -15.2)
    others = {1: np.array([*OTHER, -15.0]), 2: np.array([*CROSSING, -15.1])}
    assert decision.avoid and control.target == 1  # alone the crossing one would pass
    assert decision.rate == pytest.approx(naive.interval(OWN, 0, -15.2, 0.0, others, CasConfig()), abs=1e-3)


def test_bang_bang_keeps_to_the_one_it_avoids() -> None:
    control = VehicleController(cas_preset("thesis", controller="bang_bang"), 0)
    near, own = np.array([3.0, 0, -15, -1.5, 0, 0]), np.array([-3.0, 0, -15.2, 1.5, 0, 0])
    control.take(message(near), 0.0)
    first = control.decide(0.0, own, -15.0)
    assert first.reason == "current trajectory" and control.target == 1
    # Another one that is nearer by now does not change that.
    control.take(message(np.array([-2.0, 1.0, -15, 1.5, 0, 0]), 2), 0.0)
    held = control.decide(0.1, own, -15.0)
    assert (held.reason, held.rate, control.target) == ("held", first.rate, 1)


@pytest.mark.parametrize("controller", ["interval", "bang_bang", "continuous"])
def test_force_and_disable(controller: Any) -> None:
    def decided(**changes: Any) -> Any:
        # Passed far above, which needs no avoidance.
        control = VehicleController(CasConfig(controller=controller, smoothing=1.0, **changes), 0)
        control.take(message(np.array([20.0, 0, 0, -1.5, 0, 0])), 0.0)
        return control.decide(0.0, OWN, -15.2)

    assert decided().reason == "none"
    forced = decided(force=True)
    assert forced.avoid and forced.reason == "forced"
    control = VehicleController(CasConfig(controller=controller, smoothing=1.0, disable=True), 0)
    control.take(message(OTHER), 0.0)
    disabled = control.decide(0.0, OWN, -15.0)
    assert (disabled.avoid, disabled.reason, control.target) == (False, "none", None)
    assert disabled.rate == pytest.approx(0.1)


def test_controllers_for_fleets_are_refused() -> None:
    with pytest.raises(ValueError, match="is for fleets"):
        VehicleController(CasConfig(controller="combined"), 0)
    with pytest.raises(ValueError, match="z_wanted must be finite"):
        VehicleController(CasConfig(), 0).decide(0.0, OWN, np.nan)
