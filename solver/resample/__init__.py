"""Looking a picture up through a map."""
