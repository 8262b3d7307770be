"""The validation study: scenarios, arms, controllers and seeds; simulated, measured, compared and written down."""
