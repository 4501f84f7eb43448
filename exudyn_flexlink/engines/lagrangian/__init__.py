"""The paper's own method: hand-written equations of motion.

They are solved by an implicit method of order 9 or 13; where speeds jump by SciPy's DOP853.
"""
