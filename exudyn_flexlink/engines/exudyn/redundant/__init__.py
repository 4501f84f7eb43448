"""A scene as rigid bodies held by joints, or with beams, integrated by Exudyn's own solver."""

from exudyn_flexlink.engines.exudyn.redundant.run import ORDER, finish, prepare, solve
