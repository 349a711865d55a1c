"""From a machine to matrices: finite elements, modes, reduction, statics, parameters of the kernels."""
