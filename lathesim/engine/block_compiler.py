"""The compiler of ``run_block``: numba's own, without the passes that give every assignment a variable of its own and take that back.

They go through the whole function once for each variable that is assigned twice, of which a wiring has about a hundred: a sixth of the
time to compile. LLVM does the same for machine code, so what is left out changes neither its bits nor its speed. A variable then has one
type wherever it is assigned; in a wiring that is a float. Imported only where something is compiled.
"""

from __future__ import annotations

from typing import Any

from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager

_LEFT_OUT = ("ReconstructSSA", "PreLowerStripPhis")


class BlockCompiler(CompilerBase):  # type: ignore[misc]
    """Compiles a function whose variables keep their types."""

    def define_pipelines(self) -> list[Any]:
        """Give numba's passes but for those left out."""
        passes = PassManager("lathesim")
        usual = DefaultPassBuilder.define_nopython_pipeline(self.state).passes
        passes.passes = [item for item in usual if item[0].__name__ not in _LEFT_OUT]
        passes.finalize()
        return [passes]
