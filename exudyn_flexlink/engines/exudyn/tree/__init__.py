"""A scene as a tree of links in minimal coordinates, integrated with error control."""
