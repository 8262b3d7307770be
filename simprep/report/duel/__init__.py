"""Pictures and tables of streams: cuts, labels, structures, film strips."""
