"""Base class of a scenario file's sections: closed, immutable, finite, explained by its docstrings."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A section of a scenario."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)
