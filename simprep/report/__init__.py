"""Pictures and result files. Needs the extra `report` for pictures; result files need nothing."""
