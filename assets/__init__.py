"""Pictures, recipes and fonts that come with fluidwarp, read as package data."""
