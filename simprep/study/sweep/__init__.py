"""Many clips, many machines: a grid of cases, run once each whatever happens, kept in a store and read as one table."""
