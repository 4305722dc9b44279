"""Files: pictures, maps, clips, animations and projects, read and written."""
