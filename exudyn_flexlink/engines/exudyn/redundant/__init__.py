"""A scene as rigid bodies held by joints, or with beams, integrated by Exudyn's own solver."""

from exudyn_flexlink.engines.exudyn.redundant.outcome import ORDER, finish
from exudyn_flexlink.engines.exudyn.redundant.run import prepare, solve
