"""A scene as rigid bodies held by joints, or with beams, integrated by Exudyn's own solver."""
