"""Experiments on simulated letters: Python programs on the module `palpate`.

`./dev bench NAME` runs one of them, `./dev bench NAME --help` says what it measures. What is timed to
the microsecond is measured in C++ instead, by `build/palpate-bench`.
"""
