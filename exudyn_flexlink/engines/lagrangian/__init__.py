"""The paper's own method: hand-written equations of motion.

An implicit method of order 9 keeps the scene's tolerance; for the rest there is SciPy's DOP853.
"""
