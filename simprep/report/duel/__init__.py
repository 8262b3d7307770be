"""Pictures and tables of two-person streams: cuts, labels, structures, film strips."""
