"""The projection: makes a velocity on the MAC grid free of divergence."""
