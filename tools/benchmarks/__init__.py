"""The pieces of tools/benchmark.py and tools/scaling.py."""
