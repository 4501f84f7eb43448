"""What a notebook needs, thin: scenes and results with methods, over the rooms below.

`Scene` and `Result` here are those of the rooms below, which everything takes; they only add what
those can't know: values by path, observables, figures, tables, files. `exudyn_flexlink` itself
names them all.
"""
