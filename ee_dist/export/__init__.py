"""A model for other simulators: what is native there, what a controller shim does, what cannot be said."""

FORMATS = ("mjcf", "urdf", "yaml", "python")
