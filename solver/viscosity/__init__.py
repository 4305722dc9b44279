"""The implicit viscous step with a viscosity that varies from cell to cell."""
