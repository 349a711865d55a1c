"""A wheel carries the compiled kernels in the folder that ROTORDROP_KERNELS names; see `make wheel`."""

import os
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Kernels(BuildHookInterface[Any]):
    """Adds them, and makes the wheel one for this Python and platform; without them it is for all."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Before a wheel is built; `version` is "standard" or "editable"."""
        kernels = os.environ.get("ROTORDROP_KERNELS")
        if kernels and version == "standard":
            build_data["force_include"][kernels] = "rotordrop/compiled"
            build_data["pure_python"], build_data["infer_tag"] = False, True
