"""A scene in minimal coordinates, a spanning tree and its closures, with error-controlled steps."""
