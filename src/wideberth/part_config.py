"""The base of every part's configuration model: unknown keys and non-finite numbers are refused."""

from pydantic import BaseModel, ConfigDict


class PartConfig(BaseModel):
    """A table of a scenario. Physical keys carry their unit in the name (`range_max_m`)."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, validate_default=True)
