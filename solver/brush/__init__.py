"""What the hand does to the fluid: brushes of motion and masks of viscosity and freezing."""
