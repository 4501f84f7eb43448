"""What scripts about one saved run share."""
