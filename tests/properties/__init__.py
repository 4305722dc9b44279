"""Properties that hold for random input: `check_<name>(device, seed)` asserts them and returns what it measured."""
