"""Xu & Liu (2017) recomputed: as printed, made consistent, and compared."""
