"""The compiler of ``run_block``: numba's own, without the passes that a wiring has no need of and that cost it more than half of the time.

Left out are those that give every assignment a variable of its own and take that back, which go through the whole function once for each
variable that is assigned twice; those that look for closures, for expressions of whole arrays and for texts of Python to be written
otherwise, of which a wiring has none; and the first search for where each variable is last read, made once more before the machine code.
LLVM is given the same text without them, so what is left out changes neither bits nor speed. A variable then has one type wherever it is
assigned; in a wiring that is a float. A law that stands in the wiring and needs one of them is compiled by all of numba's passes: see
:mod:`lathesim.engine.compiling.module_cache`. Imported only where something is compiled.
"""

from __future__ import annotations

from typing import Any

from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager

_LEFT_OUT = (
    *("ReconstructSSA", "PreLowerStripPhis"),
    *("InlineClosureLikes", "GenericRewrites", "NopythonRewrites"),
    "IRProcessing",
)


class BlockCompiler(CompilerBase):  # type: ignore[misc]
    """Compiles a function whose variables keep their types."""

    def define_pipelines(self) -> list[Any]:
        """Return numba's passes but for those left out."""
        passes = PassManager("lathesim")
        usual = DefaultPassBuilder.define_nopython_pipeline(self.state).passes
        passes.passes = [item for item in usual if item[0].__name__ not in _LEFT_OUT]
        passes.finalize()
        return [passes]
