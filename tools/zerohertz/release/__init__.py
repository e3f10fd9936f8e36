"""What leaves the checkout: `zh wheel`, `zh fmu`, `zh release`."""
